//! Checks that readers with colour blindness can tell the series' colours apart.
//!
//! Protanopia and deuteranopia are simulated by the matrices of Machado, Oliveira and Fernandes, "A physiologically-based
//! model for simulation of color vision deficiency", IEEE TVCG 15(6), 2009, for severity 1.0, on linear RGB. The
//! difference is CIE 1976: the distance in CIELAB (D65); 2.3 is just noticeable.

use super::Colour;

type Rgb = [f64; 3];

const NORMAL: [Rgb; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const PROTANOPIA: [Rgb; 3] = [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
];
const DEUTERANOPIA: [Rgb; 3] = [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.011820, 0.042940, 0.968881],
];

/// Linear RGB of "#rrggbb".
fn linear(colour: &str) -> Rgb {
    [1, 3, 5].map(|at| {
        let byte = u8::from_str_radix(&colour[at..at + 2], 16).unwrap();
        let value = f64::from(byte) / 255.0;
        if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    })
}

fn multiply(matrix: &[Rgb; 3], rgb: Rgb) -> Rgb {
    matrix.map(|row| row.iter().zip(rgb).map(|(a, b)| a * b).sum())
}

fn lab(rgb: Rgb) -> [f64; 3] {
    const TO_XYZ: [Rgb; 3] = [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ];
    const WHITE: Rgb = [0.95047, 1.0, 1.08883];
    let xyz = multiply(&TO_XYZ, rgb.map(|c| c.clamp(0.0, 1.0)));
    let [x, y, z] = [0, 1, 2].map(|i| {
        let t: f64 = xyz[i] / WHITE[i];
        if t > (6.0_f64 / 29.0).powi(3) {
            t.cbrt()
        } else {
            t * (29.0_f64 / 6.0).powi(2) / 3.0 + 4.0 / 29.0
        }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// How far two colours are apart for eyes of a kind.
fn difference(eyes: &[Rgb; 3], a: &str, b: &str) -> f64 {
    let [a, b] = [a, b].map(|colour| lab(multiply(eyes, linear(colour))));
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// The least difference among colours that may meet in one figure, and the colours.
fn closest(eyes: &[Rgb; 3], shade: fn(Colour) -> &'static str) -> (f64, Colour, Colour) {
    let colours: Vec<Colour> = Colour::CYCLE.into_iter().chain([Colour::Ink]).collect();
    let pairs = colours
        .iter()
        .enumerate()
        .flat_map(|(i, &a)| colours[i + 1..].iter().map(move |&b| (a, b)));
    pairs
        .map(|(a, b)| (difference(eyes, shade(a), shade(b)), a, b))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap()
}

#[test]
fn the_simulation_knows_what_colour_blind_eyes_confuse() {
    let (red, green) = ("#b03030", "#5f6a10");
    assert!(difference(&NORMAL, red, green) > 60.0);
    assert!(difference(&DEUTERANOPIA, red, green) < 25.0);
    // Greys are the same to all eyes.
    for eyes in [PROTANOPIA, DEUTERANOPIA] {
        let grey = lab(multiply(&eyes, linear("#808080")));
        assert!(grey[1].abs() < 0.1 && grey[2].abs() < 0.1, "{grey:?}");
    }
}

#[test]
fn all_eyes_can_tell_the_series_apart_on_light_and_dark_pages() {
    let eyes = [
        ("normal", NORMAL),
        ("protanopia", PROTANOPIA),
        ("deuteranopia", DEUTERANOPIA),
    ];
    type Shade = fn(Colour) -> &'static str;
    let light: Shade = Colour::light;
    let dark: Shade = Colour::dark;
    for (name, eyes) in eyes {
        for (page, shade) in [("light", light), ("dark", dark)] {
            let (least, a, b) = closest(&eyes, shade);
            println!("{name}, {page}: {least:.1} between {a:?} and {b:?}");
            assert!(
                least > 12.0,
                "{a:?} and {b:?} are {least:.1} apart for {name} eyes on a {page} page"
            );
        }
    }
}
