//! Figures as pictures: the SVG image, drawn.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use super::{Figure, ReportError};

/// Pixels of the picture to one of the SVG image: sharp on a screen of twice the usual density.
const SCALE: f32 = 2.0;
/// The font of its texts, which comes with the program: the picture does not depend on what the computer has.
const FONT: &str = "DejaVu Sans";

impl Figure {
    /// The figure as a PNG picture. The same data give the same bytes.
    ///
    /// # Errors
    /// Data that do not fit together.
    pub fn to_png(&self) -> Result<Vec<u8>, ReportError> {
        let mut options = Options {
            font_family: FONT.to_owned(),
            ..Options::default()
        };
        options
            .fontdb_mut()
            .load_font_data(dejavu::sans::regular().to_vec());
        let tree = Tree::from_str(&self.to_svg()?, &options).map_err(ReportError::picture)?;
        let size = tree.size();
        let pixels = |length: f32| (SCALE * length).ceil() as u32;
        let mut picture = Pixmap::new(pixels(size.width()), pixels(size.height()))
            .ok_or_else(|| ReportError::picture("it has no size"))?;
        let transform = Transform::from_scale(SCALE, SCALE);
        resvg::render(&tree, transform, &mut picture.as_mut());
        picture.encode_png().map_err(ReportError::picture)
    }
}

#[cfg(test)]
mod tests {
    use resvg::tiny_skia::Pixmap;

    use super::super::{Lines, Plot, Series, Style};
    use super::Figure;

    fn figure(name: &str) -> Figure {
        Figure {
            id: "a".to_owned(),
            caption: "A line.".to_owned(),
            plot: Plot::Lines(Lines {
                x_label: "Time, s".to_owned(),
                y_label: "mm".to_owned(),
                series: vec![Series {
                    name: name.to_owned(),
                    x: vec![0.0, 1.0],
                    y: vec![0.0, 1.0],
                    style: Style::nth(0),
                }],
                ..Lines::default()
            }),
        }
    }

    fn dark(png: &[u8]) -> usize {
        let picture = Pixmap::decode_png(png).unwrap();
        assert_eq!(picture.width(), 1360);
        let pixels = picture.pixels().iter();
        pixels.filter(|pixel| pixel.red() < 128).count()
    }

    #[test]
    fn curves_and_texts_are_in_the_picture() {
        let short = dark(&figure("i").to_png().unwrap());
        let long = dark(&figure("a name of many letters").to_png().unwrap());
        assert!(short > 1000, "{short}");
        // Without a font the names would leave nothing.
        assert!(long > short + 200, "{short} {long}");
    }
}
