//! Textures against values of Mitsuba 3.9.1 (variant scalar_rgb) at the same coordinates.

use super::*;
use crate::describe::{BitmapFilter, BitmapWrap, Image, ImageId};
use glam::Vec3;
use proptest::prelude::*;
use std::sync::Arc;

/// Three columns, two rows, texel k holds (3k, 3k + 1, 3k + 2).
fn images() -> Vec<ImageDescription> {
    let rgb = Image { width: 3, height: 2, channels: 3, data: (0..18).map(|i| i as f32).collect() };
    let grey = Image { width: 2, height: 2, channels: 1, data: vec![0.1, 0.9, 0.5, 0.2] };
    vec![ImageDescription::Data(Arc::new(rgb)), ImageDescription::Data(Arc::new(grey))]
}

fn bitmap(image: u32, filter: BitmapFilter, wrap: BitmapWrap, to_uv: Mat4) -> TextureDescription {
    TextureDescription::Bitmap { image: ImageId(image), filter, wrap, to_uv, place: Place::default() }
}

fn built(description: &TextureDescription) -> (Textures, TextureSlot) {
    let (mut textures, mut problems) = (Textures::default(), Problems::default());
    let slot = textures.add(description, &images(), &mut problems);
    assert_eq!(problems.list, vec![]);
    (textures, slot)
}

#[test]
fn bitmap_equals_mitsuba() {
    use BitmapFilter::{Bilinear, Nearest};
    use BitmapWrap::{Clamp, Mirror, Repeat};
    // (filter, wrap, u, v, first lane)
    let expected = [
        (Bilinear, Repeat, 0.0, 0.0, 7.5),
        (Bilinear, Repeat, 0.1, 0.1, 3.9),
        (Bilinear, Repeat, 0.5, 0.25, 3.0),
        (Bilinear, Repeat, 0.9, 0.9, 11.100_002),
        (Bilinear, Repeat, 1.1, -0.2, 9.299_998),
        (Bilinear, Repeat, -0.3, 1.7, 12.900_001),
        (Bilinear, Repeat, 1.0, 1.0, 7.5),
        (Nearest, Repeat, 1.0, 1.0, 0.0),
        (Nearest, Mirror, 0.1, 0.1, 0.0),
        (Nearest, Mirror, 0.5, 0.25, 3.0),
        (Nearest, Mirror, 0.9, 0.9, 15.0),
        (Nearest, Mirror, 1.1, -0.2, 6.0),
        (Nearest, Mirror, -0.3, 1.7, 0.0),
        (Nearest, Mirror, 1.0, 1.0, 15.0),
        (Nearest, Clamp, 1.1, -0.2, 6.0),
        (Nearest, Clamp, -0.3, 1.7, 9.0),
    ];
    for (filter, wrap, u, v, lane) in expected {
        let (textures, slot) = built(&bitmap(0, filter, wrap, Mat4::IDENTITY));
        let uv = Vec2::new(u, v);
        let [r, g, b] = textures.eval(slot, uv).to_rgb();
        assert!(
            (r - lane).abs() < 2e-5 && (g - r - 1.0).abs() < 1e-5 && (b - r - 2.0).abs() < 1e-5,
            "{filter:?} {wrap:?} {uv}: {r}"
        );
        assert!((textures.eval1(slot, uv) - (lane + 0.859_498)).abs() < 2e-5, "luminance at {uv}");
    }
}

#[test]
fn bitmap_maps_uv_and_keeps_its_moments() {
    let to_uv = Mat4::from_translation(Vec3::new(0.25, 0.1, 0.0)) * Mat4::from_scale(Vec3::new(2.0, 3.0, 1.0));
    let (textures, slot) = built(&bitmap(0, BitmapFilter::Nearest, BitmapWrap::Repeat, to_uv));
    let at = |u, v| textures.eval(slot, Vec2::new(u, v)).to_rgb()[0];
    assert_eq!((at(0.1, 0.1), at(0.6, 0.5)), (3.0, 12.0));
    assert!((textures.mean(slot) - 8.359_498).abs() < 1e-5);
    assert_eq!(textures.max(slot).to_rgb(), [15.0, 16.0, 17.0]);
    assert_eq!(textures.min(slot).to_rgb(), [0.0, 1.0, 2.0]);
    let (textures, slot) = built(&bitmap(1, BitmapFilter::Bilinear, BitmapWrap::Repeat, Mat4::IDENTITY));
    assert!((textures.eval1(slot, Vec2::splat(0.3)) - 0.209).abs() < 1e-6);
    assert!((textures.mean(slot) - 0.425).abs() < 1e-6);
}

#[test]
fn checkerboard_equals_mitsuba() {
    let board = |to_uv, color0| TextureDescription::Checkerboard {
        color0: Box::new(color0),
        color1: Box::new(TextureDescription::grey(0.2)),
        to_uv,
        place: Place::default(),
    };
    let (textures, slot) = built(&board(Mat4::IDENTITY, TextureDescription::grey(0.4)));
    for (u, v, field0) in
        [(0.25, 0.25, true), (0.75, 0.25, false), (0.5, 0.25, true), (0.5, 0.5, true), (0.0, 0.0, true), (-0.1, 0.1, false)]
    {
        let (colour, number) = if field0 { (0.4, 0.2) } else { (0.2, 0.4) };
        assert_eq!(textures.eval(slot, Vec2::new(u, v)), Spectrum::grey(colour), "{u} {v}");
        assert_eq!(textures.eval1(slot, Vec2::new(u, v)), number, "{u} {v} as one number");
    }
    assert!((textures.mean(slot) - 0.3).abs() < 1e-7);
    // The fields' own textures see uv before the board's map.
    let inner = bitmap(0, BitmapFilter::Nearest, BitmapWrap::Repeat, Mat4::IDENTITY);
    let (textures, slot) = built(&board(Mat4::from_scale(Vec3::splat(2.0)), inner));
    assert_eq!(textures.eval(slot, Vec2::splat(0.6)).to_rgb(), [12.0, 13.0, 14.0]);
}

#[test]
fn equal_textures_are_kept_once() {
    let (mut textures, mut problems) = (Textures::default(), Problems::default());
    let images = images();
    let one = bitmap(0, BitmapFilter::Nearest, BitmapWrap::Clamp, Mat4::IDENTITY);
    let other = bitmap(0, BitmapFilter::Nearest, BitmapWrap::Mirror, Mat4::IDENTITY);
    let a = textures.add(&one, &images, &mut problems);
    assert_eq!(a, textures.add(&one, &images, &mut problems));
    assert_ne!(a, textures.add(&other, &images, &mut problems));
}

#[test]
fn wrong_images_are_problems() {
    let image = |width, height, channels, data| ImageDescription::Data(Arc::new(Image { width, height, channels, data }));
    let images = [
        image(0, 1, 1, vec![]),
        image(1, 1, 2, vec![0.0; 2]),
        image(2, 2, 3, vec![0.0; 4]),
        image(1, 1, 1, vec![f32::NAN]),
        ImageDescription::File { path: "x.png".into(), raw: false, place: Place::default() },
    ];
    for id in 0..=images.len() as u32 {
        let (mut textures, mut problems) = (Textures::default(), Problems::default());
        let texture = bitmap(id, BitmapFilter::Bilinear, BitmapWrap::Repeat, Mat4::IDENTITY);
        textures.add(&texture, &images, &mut problems);
        assert_eq!(problems.list.len(), 1, "image {id}");
    }
}

proptest! {
    #[test]
    fn any_coordinates_give_a_value_of_the_image(u in any::<f32>(), v in any::<f32>(), wrap in 0..3) {
        let wrap = [BitmapWrap::Repeat, BitmapWrap::Mirror, BitmapWrap::Clamp][wrap as usize];
        let (textures, slot) = built(&bitmap(1, BitmapFilter::Nearest, wrap, Mat4::IDENTITY));
        let x = textures.eval1(slot, Vec2::new(u, v));
        prop_assert!([0.1, 0.9, 0.5, 0.2].contains(&x));
        let (textures, slot) = built(&bitmap(1, BitmapFilter::Bilinear, wrap, Mat4::IDENTITY));
        let x = textures.eval1(slot, Vec2::new(u, v));
        prop_assert!((0.099..0.901).contains(&x), "{x}");
    }
}
