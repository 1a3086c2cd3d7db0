//! Measurements of Modayil and Kuipers, in the order of their tables.

/// Fig. 7: area and its standard deviation (cm²), perimeter and its standard deviation (cm).
pub const FEATURES: [[f64; 4]; 5] = [
    [932.0, 39.0, 113.7, 2.3],
    [3288.0, 42.0, 210.4, 1.3],
    [889.0, 27.0, 106.6, 1.5],
    [2237.0, 44.0, 169.9, 1.6],
    [4257.0, 80.0, 252.3, 1.7],
];

/// Fig. 8: minimum and maximum f_C (m²) between instances of two classes, as a lower triangle.
pub const F_C: [&[(f64, f64)]; 5] = [
    &[(0.001, 0.004)],
    &[(1.412, 2.005), (0.001, 0.005)],
    &[(0.013, 0.039), (1.662, 2.643), (0.001, 0.005)],
    &[(0.479, 0.690), (0.193, 0.376), (0.609, 0.986), (0.001, 0.003)],
    &[(2.775, 4.532), (0.239, 0.439), (3.073, 5.632), (0.958, 1.789), (0.002, 0.006)],
];

/// Fig. 9: error of position (m) and angle (rad), BV (m²), longest exterior error (m) after localisation, four to an object.
pub const LOCALISATION: [[[f64; 4]; 4]; 5] = [
    [
        [0.012, 0.003, 0.000, 0.000],
        [0.003, 0.091, 0.000, 0.008],
        [0.005, 0.112, 0.000, 0.002],
        [0.009, 0.036, 0.000, 0.000],
    ],
    [
        [0.006, 0.043, 0.001, 0.006],
        [0.005, 0.034, 0.001, 0.006],
        [0.003, 0.006, 0.001, 0.007],
        [0.023, 0.137, 0.001, 0.008],
    ],
    [
        [0.005, 0.006, 0.000, 0.005],
        [0.008, 0.110, 0.000, 0.001],
        [0.006, 0.159, 0.000, 0.000],
        [0.009, 0.121, 0.000, 0.000],
    ],
    [
        [0.009, 0.010, 0.000, 0.000],
        [0.006, 0.017, 0.000, 0.005],
        [0.021, 0.017, 0.000, 0.000],
        [0.015, 0.009, 0.001, 0.006],
    ],
    [
        [0.011, 0.290, 0.001, 0.006],
        [0.010, 0.034, 0.001, 0.006],
        [0.006, 0.087, 0.001, 0.006],
        [0.006, 0.125, 0.001, 0.006],
    ],
];

/// Fig. 5: upper bound of exterior errors after alignment, metres.
pub const EXTERIOR_M: f64 = 0.01;
/// Section V-C: maximum position error after localisation, metres; typically below `TYPICAL_M`.
pub const FARTHEST_M: f64 = 0.03;
/// See [`FARTHEST_M`].
pub const TYPICAL_M: f64 = 0.01;
/// Section V-C: displacement of a scan along x, along y (m), and rotation (rad) before
/// relocalisation.
pub const MOVED: [f64; 3] = [0.1, 0.1, 0.1];
