// The tiles of a row that a Gaussian may reach, first and end: conservative. With the row's distances dy from the mean, the ellipse is
// between slope dy -+ sqrt(curve (1 - dy^2 / half_height^2)); it reaches farthest at dy = +-reach.
// Without a curve it is a box.
struct Reach {
    float x, y;                  // the mean, from the area's origin
    float margin;                // of roundings
    float slope, curve, half_height, reach;
    uint tiles_x, tiles_y;       // first | last << 16; the first may be beyond the last: none
};

// Tiles are counted by one kernel and written by another: `precise` makes both find the same ones.

float margin_of(vec2 mean, vec2 place, float half_width, float half_height) {
    precise float margin = 2e-6 * (abs(place.x) + abs(place.y) + abs(mean.x) + abs(mean.y) + half_height + half_width + 1.0) + 0.02;
    return margin;
}

// The columns of tiles within half a width of a place; first | last << 16.
uint columns(float x, float half_width, uint tiles_across) {
    precise float left = floor(x - half_width - 0.5), right = ceil(x + half_width + 0.5);
    float most = float(TILE * tiles_across);
    if (!(right >= 0.0 && left < most)) {
        return 0xffffu;
    }
    return uint(max(left, 0.0)) / TILE | min(uint(min(right, most)) / TILE, tiles_across - 1u) << 16;
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
    if (r.curve < 0.0) {
        first = int(r.tiles_x & 0xffffu);
        end = int(r.tiles_x >> 16) + 1;
    }
    return top <= bottom && end > first ? uvec2(first, end) : uvec2(0u);
}

// The copies of a Gaussian in a panorama, which is drawn where it is and a period to its left and to its right. The pair of a tile and
// a Gaussian has the copy's number above the Gaussian's.
const uint COPIES = 3u, COPY_SHIFT = 24u, MEMBER = 0xffffffu;

uint copies() {
    return push.set.derived.of.period.x == 0.0 ? 1u : COPIES;
}

// How many periods a copy is to the right.
float periods(uint copy) {
    return copy == 2u ? -1.0 : float(copy);
}

// A copy's place, from the area's origin.
vec2 place_of_copy(vec2 mean, uint copy) {
    precise float x = (mean.x - float(push.set.area_origin.x)) + periods(copy) * push.set.derived.of.period.x;
    precise float y = mean.y - float(push.set.area_origin.y);
    return vec2(x, y);
}

Reach reach_of(Record r, uint copy) {
    vec2 mean = vec2(r.mean_x.x, r.mean_y.x), place = place_of_copy(mean, copy);
    float margin = margin_of(mean, place, r.half_width, r.half_height);
    uint tiles_x = columns(place.x, r.half_width, push.set.tiles.x);
    Reach reach = Reach(place.x, place.y, margin, r.slope, r.curve, r.half_height, r.reach, tiles_x, r.tiles_y);
    if (push.set.is_surfel != 0u) {
        reach.slope = 0.0;
        reach.curve = -1.0;
        reach.reach = 0.0;
    }
    return reach;
}

// The tiles of a cut-off along an axis, from the viewport's corner: first | end << 16.
uint cut_tiles(float from, float radius) {
    float first = floor((from - radius) / 16.0), end = ceil((from + radius) / 16.0);
    if (push.set.cut_off == TILE_SQUARE) {
        first = floor((from - 0.5 - radius) / 16.0);
        end = floor((from - 0.5 + radius + 15.0) / 16.0);
    }
    return uint(clamp(first, 0.0, 65535.0)) | uint(clamp(end, 0.0, 65535.0)) << 16;
}
