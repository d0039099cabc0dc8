//! Rules of integration on [-1, 1].

/// Nodes and weights of one rule.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    /// Where the function is asked, -1 to 1.
    pub nodes: &'static [f32],
    /// What each answer counts; together 2.
    pub weights: &'static [f32],
}

/// The largest Gauss rule there is.
pub(crate) const MAX_ORDER: usize = 10;

/// The Gauss-Legendre rule of `n` nodes, 1 to [`MAX_ORDER`]: exact for polynomials of degree 2 n - 1.
#[inline(always)]
pub(crate) const fn gauss(n: usize) -> Rule {
    let (nodes, weights) = GAUSS[n - 1];
    Rule { nodes, weights }
}

/// Nodes of the Kronrod rule of 15, and a sixteenth lane that counts nothing.
pub(crate) const KRONROD: [f32; 16] = [
    -0.991_455_4,
    -0.949_107_9,
    -0.864_864_4,
    -0.741_531_2,
    -0.586_087_2,
    -0.405_845_14,
    -0.207_784_95,
    0.0,
    0.207_784_95,
    0.405_845_14,
    0.586_087_2,
    0.741_531_2,
    0.864_864_4,
    0.949_107_9,
    0.991_455_4,
    0.0,
];

/// Weights of the Kronrod rule: exact for polynomials of degree 23.
pub(crate) const KRONROD_WEIGHTS: [f32; 16] = [
    0.022_935_322,
    0.063_092_09,
    0.104_790_01,
    0.140_653_25,
    0.169_004_72,
    0.190_350_58,
    0.204_432_93,
    0.209_482_13,
    0.204_432_93,
    0.190_350_58,
    0.169_004_72,
    0.140_653_25,
    0.104_790_01,
    0.063_092_09,
    0.022_935_322,
    0.0,
];

/// Weights, at the same nodes, of the Gauss rule of 7 inside it: the difference of the two says how far the answer can
/// be wrong.
pub(crate) const EMBEDDED_WEIGHTS: [f32; 16] = [
    0.0,
    0.129_484_97,
    0.0,
    0.279_705_4,
    0.0,
    0.381_830_04,
    0.0,
    0.417_959_18,
    0.0,
    0.381_830_04,
    0.0,
    0.279_705_4,
    0.0,
    0.129_484_97,
    0.0,
    0.0,
];

/// Nodes of the Kronrod rule of 7, twice, each with a lane that counts nothing.
pub(crate) const KRONROD_PAIR: [f32; 16] = twice(SEVEN, SEVEN);

/// Weights of the Kronrod rule of 7, which is exact for polynomials of degree 11: of the first lanes, and of the
/// others.
pub(crate) const KRONROD_PAIR_WEIGHTS: [[f32; 16]; 2] =
    [twice(SEVEN_WEIGHTS, [0.0; 8]), twice([0.0; 8], SEVEN_WEIGHTS)];

/// Weights, at the same nodes, of the Gauss rule of 3 inside it.
pub(crate) const EMBEDDED_PAIR_WEIGHTS: [[f32; 16]; 2] =
    [twice(THREE_WEIGHTS, [0.0; 8]), twice([0.0; 8], THREE_WEIGHTS)];

const SEVEN: [f32; 8] = [-0.960_491_3, -0.774_596_7, -0.434_243_74, 0.0, 0.434_243_74, 0.774_596_7, 0.960_491_3, 0.0];
const SEVEN_WEIGHTS: [f32; 8] =
    [0.104_656_22, 0.268_488_1, 0.401_397_4, 0.450_916_54, 0.401_397_4, 0.268_488_1, 0.104_656_22, 0.0];
const THREE_WEIGHTS: [f32; 8] = [0.0, 0.555_555_6, 0.0, 0.888_888_9, 0.0, 0.555_555_6, 0.0, 0.0];

const fn twice(one: [f32; 8], other: [f32; 8]) -> [f32; 16] {
    let mut all = [0.0; 16];
    let mut k = 0;
    while k < 8 {
        (all[k], all[k + 8]) = (one[k], other[k]);
        k += 1;
    }
    all
}

#[rustfmt::skip]
const GAUSS: [(&[f32], &[f32]); MAX_ORDER] = [
    (&[0.0], &[2.0]),
    (&[-0.577_350_26, 0.577_350_26], &[1.0, 1.0]),
    (&[-0.774_596_7, 0.0, 0.774_596_7], &[0.555_555_6, 0.888_888_9, 0.555_555_6]),
    (&[-0.861_136_3, -0.339_981_05, 0.339_981_05, 0.861_136_3],
     &[0.347_854_85, 0.652_145_15, 0.652_145_15, 0.347_854_85]),
    (&[-0.906_179_85, -0.538_469_3, 0.0, 0.538_469_3, 0.906_179_85],
     &[0.236_926_88, 0.478_628_67, 0.568_888_9, 0.478_628_67, 0.236_926_88]),
    (&[-0.932_469_5, -0.661_209_4, -0.238_619_2, 0.238_619_2, 0.661_209_4, 0.932_469_5],
     &[0.171_324_5, 0.360_761_58, 0.467_913_93, 0.467_913_93, 0.360_761_58, 0.171_324_5]),
    (&[-0.949_107_9, -0.741_531_2, -0.405_845_14, 0.0, 0.405_845_14, 0.741_531_2, 0.949_107_9],
     &[0.129_484_97, 0.279_705_4, 0.381_830_04, 0.417_959_18, 0.381_830_04, 0.279_705_4, 0.129_484_97]),
    (&[-0.960_289_84, -0.796_666_5, -0.525_532_4, -0.183_434_64, 0.183_434_64, 0.525_532_4, 0.796_666_5, 0.960_289_84],
     &[0.101_228_535, 0.222_381_03, 0.313_706_64, 0.362_683_77, 0.362_683_77, 0.313_706_64, 0.222_381_03,
       0.101_228_535]),
    (&[-0.968_160_2, -0.836_031_1, -0.613_371_43, -0.324_253_4, 0.0, 0.324_253_4, 0.613_371_43, 0.836_031_1,
       0.968_160_2],
     &[0.081_274_39, 0.180_648_16, 0.260_610_7, 0.312_347_08, 0.330_239_36, 0.312_347_08, 0.260_610_7, 0.180_648_16,
       0.081_274_39]),
    (&[-0.973_906_5, -0.865_063_37, -0.679_409_56, -0.433_395_4, -0.148_874_34, 0.148_874_34, 0.433_395_4,
       0.679_409_56, 0.865_063_37, 0.973_906_5],
     &[0.066_671_34, 0.149_451_35, 0.219_086_36, 0.269_266_72, 0.295_524_24, 0.295_524_24, 0.269_266_72,
       0.219_086_36, 0.149_451_35, 0.066_671_34]),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(nodes: &[f32], weights: &[f32], degree: i32) -> f64 {
        nodes.iter().zip(weights).map(|(x, w)| (0..degree).fold(f64::from(*w), |term, _| term * f64::from(*x))).sum()
    }

    fn truth(degree: i32) -> f64 {
        if degree % 2 == 1 { 0.0 } else { 2.0 / f64::from(degree + 1) }
    }

    #[test]
    fn rules_are_exact_up_to_their_degree_and_not_beyond() {
        for n in 1..=MAX_ORDER {
            let rule = gauss(n);
            assert_eq!((rule.nodes.len(), rule.weights.len()), (n, n));
            for degree in 0..2 * n as i32 {
                let error = moment(rule.nodes, rule.weights, degree) - truth(degree);
                assert!(error.abs() < 4e-7, "{n} nodes, degree {degree}: {error}");
            }
            if n < 8 {
                let error = moment(rule.nodes, rule.weights, 2 * n as i32) - truth(2 * n as i32);
                assert!(error.abs() > 1e-5, "{n} nodes are no rule of Gauss");
            }
        }
        for degree in 0..=23 {
            let error = moment(&KRONROD, &KRONROD_WEIGHTS, degree) - truth(degree);
            assert!(error.abs() < 4e-7, "Kronrod, degree {degree}: {error}");
            if degree < 14 {
                let error = moment(&KRONROD, &EMBEDDED_WEIGHTS, degree) - truth(degree);
                assert!(error.abs() < 4e-7, "embedded, degree {degree}: {error}");
            }
        }
    }
}
