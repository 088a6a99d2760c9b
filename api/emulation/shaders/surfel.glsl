// A 2D Gaussian. With the distances dx and dy from the mean, in pixels, the ray of a pixel meets its plane at (u, v) standard deviations:
// u = (ux dx + uy dy) / w, v = (vx dx + vy dy) / w, w = 1 + wx dx + wy dy, where 0 < w < limit.
struct Surfel {
    vec2 ux, uy, vx, vy, wx, wy;     // pairs
    float limit;
};

Surfel surfel_of(Record r) {
    return Surfel(r.f0, r.f1, r.f2, vec2(r.slope, r.curve), vec2(r.reach, uintBitsToFloat(r.cut_y)), vec2(r.cut_radius, r.unused0),
                  r.unused1);
}

void set_surfel(inout Record r, Surfel s) {
    r.f0 = s.ux;
    r.f1 = s.uy;
    r.f2 = s.vx;
    r.slope = s.vy.x;
    r.curve = s.vy.y;
    r.reach = s.wx.x;
    r.cut_y = floatBitsToUint(s.wx.y);
    r.cut_radius = s.wy.x;
    r.unused0 = s.wy.y;
    r.unused1 = s.limit;
}
