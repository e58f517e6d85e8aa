//! Tests of PNG reading and writing: round trips, colour, limits.

use super::*;

fn ramp(levels: u32, full_scale: f64) -> GrayImage {
    GrayImage::from_fn(64, levels.div_ceil(64), |x, y| {
        Luma([(f64::from((y * 64 + x).min(levels - 1)) / full_scale) as f32])
    })
}

/// A PNG whose header has a size but no pixels; its checksum is correct, so that only the size can be refused.
fn header_only(width: u32, height: u32) -> Vec<u8> {
    let mut ihdr = b"IHDR".to_vec();
    ihdr.extend(width.to_be_bytes());
    ihdr.extend(height.to_be_bytes());
    ihdr.extend([16, 0, 0, 0, 0]);
    let crc = !ihdr.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xEDB8_8320 } else { c >> 1 })
    });
    let idat = [0, 0, 0, 0, b'I', b'D', b'A', b'T', 0x35, 0xAF, 0x06, 0x1E];
    [&b"\x89PNG\r\n\x1a\n"[..], &[0, 0, 0, 13], &ihdr, &crc.to_be_bytes(), &idat].concat()
}

#[test]
fn eight_and_sixteen_bits_survive_the_round_trip_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let (path8, path16) = (folder.path().join("8.png"), folder.path().join("16.png"));
    let (image8, image16) = (ramp(256, 255.0), ramp(4096, 4095.0));
    write_png_u8(&path8, &image8).unwrap();
    write_png_u16(&path16, &image16, Some(4095.0)).unwrap();
    assert_eq!(read_png(&path8, None).unwrap(), image8);
    assert_eq!(read_png(&path16, Some(4095.0)).unwrap(), image16);
    let all = ramp(65_536, 65_535.0);
    assert_eq!(decode_png(&encode_png_u16(&all, None).unwrap(), "all", None).unwrap(), all);
}

#[test]
fn values_outside_the_scale_are_cut_and_invalid_pixels_become_black() {
    let image = GrayImage::from_raw(4, 1, vec![-0.5, 1.5, f32::NAN, 0.5]).unwrap();
    let back = decode_png(&encode_png_u8(&image).unwrap(), "cut", None).unwrap();
    assert_eq!(back.as_raw(), &vec![0.0, 1.0, 0.0, (128.0 / 255.0) as f32]);
}

#[test]
fn colour_becomes_luma() {
    let colour = image::RgbImage::from_pixel(2, 2, image::Rgb([255, 128, 0]));
    let mut bytes = Cursor::new(Vec::new());
    colour.write_to(&mut bytes, ImageFormat::Png).unwrap();
    let grey = decode_png(bytes.get_ref(), "colour", None).unwrap();
    let expected = (0.2126 * 255.0 + 0.7152 * 128.0) / 255.0;
    assert!(grey.iter().all(|v| (f64::from(*v) - expected).abs() < 1e-6));
}

#[test]
fn a_huge_image_is_refused_in_one_sentence_before_any_pixel_is_decoded() {
    let error = decode_png(&header_only(100_000, 100_000), "huge.png", None).unwrap_err().to_string();
    assert_eq!(error, "huge.png: the image has 100000 × 100000 pixels; at most 64 million can be read");
}

#[test]
fn damaged_and_foreign_files_are_named() {
    let whole = encode_png_u8(&ramp(256, 255.0)).unwrap();
    for bytes in [&whole[..40], &b"P5 2 2 255\n...."[..], &header_only(10, 10), &[]] {
        let error = decode_png(bytes, "some/file.png", None).unwrap_err().to_string();
        assert!(error.starts_with("some/file.png: not a PNG image that can be read"), "{error}");
    }
    assert!(matches!(read_png("no/such/file.png", None), Err(Error::Read { .. })));
    assert!(matches!(read_png(".", None), Err(Error::Read { .. })));
    assert!(decode_png(&whole, "zero", Some(0.0)).unwrap_err().to_string().contains("full scale"));
}

#[test]
fn header_states_the_size_and_bounds_the_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.png");
    write_png_u16(&path, &GrayImage::new(3000, 1000), None).unwrap();
    assert_eq!(png_size(&path).unwrap(), [3000, 1000]);
    assert_eq!(read_png_of_size(&path, None, [3000, 1000]).unwrap().dimensions(), (3000, 1000));
    let small = read_png_of_size(&path, None, [3, 3]).unwrap_err().to_string();
    assert!(small.ends_with("image.png: the image has 3000 × 1000 pixels; at most 9 can be read"), "{small}");
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..24]).unwrap();
    assert_eq!(png_size(&path).unwrap(), [3000, 1000]);
    for damaged in [&whole[..23], &b"GIF89a, which is followed by enough bytes"[..]] {
        std::fs::write(&path, damaged).unwrap();
        let message = png_size(&path).unwrap_err().to_string();
        assert!(message.contains("image.png: not a PNG image that can be read"), "{message}");
    }
}
