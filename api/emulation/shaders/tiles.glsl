// The tiles of a row that a Gaussian may reach, first and end: conservative. With the row's distances dy from the mean, the ellipse is
// between slope dy -+ sqrt(curve (1 - dy^2 / half_height^2)); it reaches farthest at dy = +-reach.
struct Reach {
    float x, y;                  // the mean, from the area's origin
    float margin;                // of roundings
    float slope, curve, half_height, reach;
    uint tiles_x, tiles_y;       // first | last << 16
};

// Tiles are counted by one kernel and written by another: `precise` makes both find the same ones.

float margin_of(vec2 mean, vec2 origin, float half_width, float half_height) {
    precise vec2 from = mean - origin;
    precise float margin = 2e-6 * (abs(from.x) + abs(from.y) + abs(mean.x) + abs(mean.y) + half_height + half_width + 1.0) + 0.02;
    return margin;
}

uvec2 tiles_of_row(Reach r, uint row, uint tiles_across) {
    float height = r.half_height, margin = r.margin;
    precise float top = max(float(row * TILE) + 0.5 - r.y - margin, -height);
    precise float bottom = min(float(row * TILE) + 15.5 - r.y + margin, height);
    precise float curve = r.curve / (height * height), taller = (height + margin) * (height + margin);
    precise float at_right = clamp(r.reach, top, bottom), at_left = clamp(-r.reach, top, bottom);
    precise float around = margin * (1.0 + abs(r.slope));
    precise float right = r.x + r.slope * at_right + sqrt(max(0.0, curve * (taller - at_right * at_right))) + around;
    precise float left = r.x + r.slope * at_left - sqrt(max(0.0, curve * (taller - at_left * at_left))) - around;
    float most = 16.0 * float(tiles_across) + 16.0;
    int first = int(floor((clamp(left, -16.0, most) - 0.5) / 16.0)), end = int(floor((clamp(right, -16.0, most) + 0.5) / 16.0)) + 1;
    first = max(first, int(r.tiles_x & 0xffffu));
    end = min(end, int(r.tiles_x >> 16) + 1);
    return top <= bottom && end > first ? uvec2(first, end) : uvec2(0u);
}

Reach reach_of(uint index) {
    Record r = push.set.records.at[index];
    vec2 mean = vec2(r.mean_x.x, r.mean_y.x), origin = vec2(push.set.area_origin);
    float margin = margin_of(mean, origin, r.half_width, r.half_height);
    return Reach(mean.x - origin.x, mean.y - origin.y, margin, r.slope, r.curve, r.half_height, r.reach, r.tiles_x, r.tiles_y);
}
