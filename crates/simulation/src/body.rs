use super::{Label, Solid};

/// Box of a body, relative to the middle of the body on the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Middle of the box ahead and to the left of the body's middle, in metres.
    pub ahead_m: f64,
    pub left_m: f64,
    /// Size in metres, along the heading and across.
    pub size_m: [f64; 2],
    /// Lower and upper end above the ground, in metres.
    pub z_m: [f64; 2],
    /// Share of reflected light, 0 to 1.
    pub reflectivity: f64,
}

/// Position and heading of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Middle of the body in metres, world frame.
    pub at_m: [f64; 2],
    /// Unit vector of the heading, along x or y.
    pub ahead: [f64; 2],
    /// Height of the ground in metres.
    pub ground_m: f64,
}

const RUBBER: f64 = 0.1;

impl Part {
    /// Returns a box in the middle of the body.
    fn middle(size_m: [f64; 2], z_m: [f64; 2], reflectivity: f64) -> Self {
        Self { ahead_m: 0.0, left_m: 0.0, size_m, z_m, reflectivity }
    }

    fn ahead(self, ahead_m: f64) -> Self {
        Self { ahead_m, ..self }
    }

    fn left(self, left_m: f64) -> Self {
        Self { left_m, ..self }
    }
}

impl Place {
    /// Returns the place shifted by a distance ahead and to the left, in metres.
    pub fn shifted(self, ahead_m: f64, left_m: f64) -> Self {
        let [hx, hy] = self.ahead;
        let [x, y] = self.at_m;
        Self { at_m: [x + hx * ahead_m - hy * left_m, y + hy * ahead_m + hx * left_m], ..self }
    }

    /// Returns the boxes of a body at this place.
    pub fn body(self, parts: impl IntoIterator<Item = Part>, label: Label) -> Vec<Solid> {
        let solid = |part: Part| {
            let corner = |sign: f64, z_m: f64| {
                let [half_ahead, half_left] = part.size_m.map(|size| sign * 0.5 * size);
                let [x, y] = self.shifted(part.ahead_m + half_ahead, part.left_m + half_left).at_m;
                [x, y, self.ground_m + z_m]
            };
            let [low, high] = part.z_m;
            Solid::new(corner(-1.0, low), corner(1.0, high), part.reflectivity).labelled(label)
        };
        parts.into_iter().map(solid).collect()
    }
}

/// Returns a car or a van; at most 5 m long, 1.9 m wide and 2.25 m high.
pub(super) fn car(is_van: bool, paint: f64) -> Vec<Part> {
    let mut parts: Vec<Part> = [-1.4, 1.4]
        .map(|axle_m| Part::middle([0.62, 1.7], [0.0, 0.62], RUBBER).ahead(axle_m))
        .into_iter()
        .collect();
    if is_van {
        parts.push(Part::middle([5.0, 1.9], [0.35, 2.25], paint));
    } else {
        parts.push(Part::middle([4.3, 1.8], [0.3, 0.9], paint));
        parts.push(Part::middle([2.3, 1.6], [0.9, 1.48], 0.6 * paint).ahead(-0.2));
    }
    parts
}

/// Returns a tram of 14 x 2.3 x 3.2 m.
pub(super) fn tram() -> Vec<Part> {
    vec![
        Part::middle([2.2, 1.9], [0.0, 0.5], RUBBER).ahead(-4.2),
        Part::middle([2.2, 1.9], [0.0, 0.5], RUBBER).ahead(4.2),
        Part::middle([14.0, 2.3], [0.3, 3.2], 0.5),
    ]
}

/// Returns a cyclist, 1.75 m long, 0.46 m wide and 1.8 m high.
pub(super) fn cyclist(clothes: f64) -> Vec<Part> {
    let wheel = Part::middle([0.65, 0.06], [0.0, 0.66], RUBBER);
    vec![
        wheel.ahead(-0.55),
        wheel.ahead(0.55),
        Part::middle([0.6, 0.06], [0.3, 0.85], 0.6),
        Part::middle([0.3, 0.34], [0.35, 0.95], 0.7 * clothes),
        Part::middle([0.36, 0.46], [0.95, 1.52], clothes),
        Part::middle([0.2, 0.18], [1.55, 1.8], 0.4).ahead(0.1),
    ]
}

/// Returns a person of about 1.75 m height, 0.44 m wide, whose left foot is `stride_m` metres ahead.
pub(super) fn walker(clothes: f64, height: f64, stride_m: f64) -> Vec<Part> {
    let leg = Part::middle([0.17, 0.16], [0.0, 0.82 * height], 0.6 * clothes);
    vec![
        leg.ahead(stride_m).left(0.11),
        leg.ahead(-stride_m).left(-0.11),
        Part::middle([0.26, 0.44], [0.82 * height, 1.46 * height], clothes),
        Part::middle([0.2, 0.18], [1.48 * height, 1.75 * height], 0.4),
    ]
}

/// Returns a door leaf of `width_m` x 1.65 m whose hinge is at the middle of the body. `open` is the unit vector from
/// the hinge to the other edge, ahead and to the left. A row of boxes approximates a leaf that is not parallel to an
/// axis.
pub(super) fn door_leaf(width_m: f64, open: [f64; 2]) -> Vec<Part> {
    const PIECES: u32 = 8;
    const THICKNESS_M: f64 = 0.04;
    let piece_m = width_m / f64::from(PIECES);
    let part = |number: u32| {
        let middle_m = piece_m * (f64::from(number) + 0.5);
        let size_m = open.map(|share| share.abs() * piece_m + THICKNESS_M);
        Part::middle(size_m, [0.55, 2.2], 0.45).ahead(middle_m * open[0]).left(middle_m * open[1])
    };
    (0..PIECES).map(part).collect()
}
