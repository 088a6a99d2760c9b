// The tiles of a row that a Gaussian may reach, first and end: conservative. With the row's distances dy from the mean, the ellipse is
// between slope dy -+ sqrt(curve (1 - dy^2 / half_height^2)); it reaches farthest at dy = +-reach.
uvec2 tiles_of_row(uint index, uint row) {
    Record r = push.set.records.at[index];
    float x = r.mean_x.x - float(push.set.area_origin.x), y = r.mean_y.x - float(push.set.area_origin.y);
    // Of roundings.
    float margin = 2e-6 * (abs(x) + abs(y) + abs(r.mean_x.x) + abs(r.mean_y.x) + r.half_height + r.half_width + 1.0) + 0.02;
    float top = float(row * TILE) + 0.5 - y - margin, bottom = float(row * TILE) + 15.5 - y + margin;
    float height = r.half_height;
    top = max(top, -height);
    bottom = min(bottom, height);
    if (top > bottom) {
        return uvec2(0u);
    }
    float curve = r.curve / (height * height), taller = (height + margin) * (height + margin), slope = r.slope;
    float at_right = clamp(r.reach, top, bottom), at_left = clamp(-r.reach, top, bottom);
    float around = margin * (1.0 + abs(slope));
    float right = x + slope * at_right + sqrt(max(0.0, curve * (taller - at_right * at_right))) + around;
    float left = x + slope * at_left - sqrt(max(0.0, curve * (taller - at_left * at_left))) - around;
    float most = 16.0 * float(push.set.tiles.x) + 16.0;
    int first = int(floor((clamp(left, -16.0, most) - 0.5) / 16.0)), end = int(floor((clamp(right, -16.0, most) + 0.5) / 16.0)) + 1;
    first = max(first, int(r.tiles_x & 0xffffu));
    end = min(end, int(r.tiles_x >> 16) + 1);
    return end > first ? uvec2(first, end) : uvec2(0u);
}
