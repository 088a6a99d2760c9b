//! A projected Gaussian and the shapes that bound it.

/// The least alpha that contributes.
pub const ALPHA_FLOOR: f64 = 1.0 / 255.0;

/// A projected Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// The number of the Gaussian in its scene.
    pub id: u32,
    /// The centre in pixels.
    pub mean: [f64; 2],
    /// The covariance `xx, xy, yy` in px^2.
    pub covariance: [f64; 3],
    /// The opacity.
    pub opacity: f64,
}

impl Footprint {
    /// The conic `a, b, c` of the form `a dx^2 + 2 b dx dy + c dy^2`: the inverse of the covariance.
    pub fn conic(&self) -> [f64; 3] {
        let [xx, xy, yy] = self.covariance;
        [yy, -xy, xx].map(|value| value / (xx * yy - xy * xy))
    }

    /// The form at which alpha is at its floor. It is negative if the Gaussian is fainter than that.
    pub fn cut(&self) -> f64 {
        2.0 * (self.opacity / ALPHA_FLOOR).ln()
    }

    /// The least form over a rectangle.
    pub fn least_form(&self, rectangle: &Rectangle) -> f64 {
        let [a, b, c] = self.conic();
        let low = [0, 1].map(|axis| rectangle.low[axis] - self.mean[axis]);
        let high = [0, 1].map(|axis| rectangle.high[axis] - self.mean[axis]);
        if (0..2).all(|axis| low[axis] <= 0.0 && high[axis] >= 0.0) {
            return 0.0;
        }
        let form = |x: f64, y: f64| a * x * x + 2.0 * b * x * y + c * y * y;
        // The form is convex, so that its least value is on an edge, at the edge's nearest point.
        let sides = [low[0], high[0]].map(|x| form(x, (-b * x / c).clamp(low[1], high[1])));
        let ends = [low[1], high[1]].map(|y| form((-b * y / a).clamp(low[0], high[0]), y));
        sides.into_iter().chain(ends).fold(f64::INFINITY, f64::min)
    }

    /// True if alpha is at least its floor somewhere in a rectangle.
    pub fn reaches(&self, rectangle: &Rectangle) -> bool {
        self.least_form(rectangle) <= self.cut()
    }

    /// The rectangle around the ellipse in which alpha is at least its floor.
    pub fn bounds(&self) -> Rectangle {
        let [xx, _, yy] = self.covariance;
        let reach = [xx, yy].map(|variance| (self.cut().max(0.0) * variance).sqrt());
        Rectangle::around(self.mean, reach)
    }

    /// The standard deviations along the ellipse's axes, the longer one first, and the direction of that one.
    fn axes(&self) -> ([f64; 2], [f64; 2]) {
        let [xx, xy, yy] = self.covariance;
        let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let spread = (half * half + xy * xy).sqrt();
        let direction = if spread > 0.0 { [half + spread, xy] } else { [1.0, 0.0] };
        // The direction is zero if y is the longer axis.
        let length = (direction[0] * direction[0] + direction[1] * direction[1]).sqrt();
        let direction = if length > 0.0 { direction.map(|part| part / length) } else { [0.0, 1.0] };
        ([(middle + spread).sqrt(), (middle - spread).max(0.0).sqrt()], direction)
    }

    /// The ratio of the longer axis to the shorter one.
    pub fn elongation(&self) -> f64 {
        let ([longer, shorter], _) = self.axes();
        longer / shorter
    }

    /// The square around the circle of three standard deviations of the longer axis, rounded up to pixels, to which the
    /// original 3DGS code bins. That code rounds the far corner down to a pixel.
    pub fn square(&self) -> Rectangle {
        let ([longer, _], _) = self.axes();
        let square = Rectangle::around(self.mean, [(3.0 * longer).ceil(); 2]);
        Rectangle { high: square.high.map(f64::floor), ..square }
    }
}

/// A rectangle along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// The corner of the least coordinates.
    pub low: [f64; 2],
    /// The corner of the greatest coordinates.
    pub high: [f64; 2],
}

impl Rectangle {
    /// The rectangle from a middle to both sides.
    pub fn around(middle: [f64; 2], reach: [f64; 2]) -> Self {
        Self { low: [middle[0] - reach[0], middle[1] - reach[1]], high: [middle[0] + reach[0], middle[1] + reach[1]] }
    }

    /// The square of pixels from a corner.
    pub fn pixels(corner: [f64; 2], side: f64) -> Self {
        Self { low: corner, high: corner.map(|place| place + side) }
    }

    /// The square of pixel centres of such a square.
    pub fn centres(corner: [f64; 2], side: f64) -> Self {
        Self { low: corner.map(|place| place + 0.5), high: corner.map(|place| place + side - 0.5) }
    }

    /// True if two rectangles share more than an edge.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] < other.high[axis] && other.low[axis] < self.high[axis])
    }
}

/// A rectangle along the axes of an ellipse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    middle: [f64; 2],
    /// The direction of its longer axis.
    direction: [f64; 2],
    /// Half of its sides.
    reach: [f64; 2],
}

impl OrientedBox {
    /// The box of three standard deviations to each side.
    pub fn new(footprint: &Footprint) -> Self {
        let (deviations, direction) = footprint.axes();
        Self { middle: footprint.mean, direction, reach: deviations.map(|deviation| 3.0 * deviation) }
    }

    /// True if the box overlaps a rectangle: no axis of either separates the two.
    pub fn overlaps(&self, rectangle: &Rectangle) -> bool {
        let [u, v] = self.direction;
        let half = [0, 1].map(|axis| 0.5 * (rectangle.high[axis] - rectangle.low[axis]));
        let away = [0, 1].map(|axis| 0.5 * (rectangle.high[axis] + rectangle.low[axis]) - self.middle[axis]);
        let [along, across] = self.reach;
        let own = [u.abs() * along + v.abs() * across, v.abs() * along + u.abs() * across];
        let overlaps_axes = (0..2).all(|axis| away[axis].abs() < own[axis] + half[axis]);
        let places = [u * away[0] + v * away[1], u * away[1] - v * away[0]];
        let theirs = [u.abs() * half[0] + v.abs() * half[1], v.abs() * half[0] + u.abs() * half[1]];
        overlaps_axes && (0..2).all(|axis| places[axis].abs() < self.reach[axis] + theirs[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gaussian with deviations 5 and 1 along the diagonal, at (8, 8).
    fn diagonal() -> Footprint {
        Footprint { id: 0, mean: [8.0; 2], covariance: [13.0, 12.0, 13.0], opacity: 1.0 }
    }

    #[test]
    fn a_conic_is_the_inverse_of_the_covariance() {
        let [a, b, c] = diagonal().conic();
        assert!((13.0 * a + 12.0 * b - 1.0).abs() < 1e-12 && (12.0 * a + 13.0 * b).abs() < 1e-12);
        assert!((12.0 * b + 13.0 * c - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_least_form_is_at_the_nearest_point() {
        let round = Footprint { covariance: [4.0, 0.0, 4.0], ..diagonal() };
        let at = |low, high| round.least_form(&Rectangle { low, high });
        assert_eq!(at([0.0; 2], [16.0; 2]), 0.0);
        assert!((at([14.0, 0.0], [20.0, 16.0]) - 9.0).abs() < 1e-12);
        assert!((at([11.0, 12.0], [20.0; 2]) - 25.0 / 4.0).abs() < 1e-12);
        // On the line x = 13, the tilted form is least where y follows x: dx^2 / xx.
        let least = diagonal().least_form(&Rectangle { low: [13.0, -50.0], high: [60.0, 50.0] });
        assert!((least - 25.0 / 13.0).abs() < 1e-12);
    }

    #[test]
    fn boxes_follow_the_ellipse() {
        let oriented = OrientedBox::new(&diagonal());
        assert!((oriented.reach[0] - 15.0).abs() < 1e-9 && (oriented.reach[1] - 3.0).abs() < 1e-9);
        assert!(oriented.overlaps(&Rectangle::pixels([16.0, 16.0], 16.0)));
        // The square of three deviations covers the other diagonal, too.
        let beside = Rectangle::pixels([16.0, -16.0], 16.0);
        assert!(!oriented.overlaps(&beside) && diagonal().square().overlaps(&beside));
        let upright = Footprint { covariance: [1.0, 0.0, 25.0], ..diagonal() };
        assert!(OrientedBox::new(&upright).overlaps(&Rectangle::pixels([8.0, 22.0], 4.0)));
        assert!(!OrientedBox::new(&upright).overlaps(&Rectangle::pixels([12.0, 8.0], 4.0)));
    }
}
