//! JPL's text form of camera models: `.cahv`, `.cahvor` and `.cahvore` files.
//!
//! ```text
//! # comment
//! Model = CAHVORE3,0.37 = general
//! Dimensions = 1024 1024
//! C = x y z
//! ```
//!
//! and then A, H, V, O, R, E likewise (m, px and unit as in the module's table); `CAHVORE1` is perspective,
//! `CAHVORE2` fisheye, `CAHVORE3,P` general; CAHV and CAHVOR have no number. Spaces are free, numbers may continue in
//! the next line, and unknown keys are skipped: the covariances `S`, `S internal` and the derived `Hs`, `Hc`, `Vs`,
//! `Vc`, `Theta` are not kept. Numbers are written with all digits of an f64. Source: domain.md 2.7; VICAR
//! `cmod_stdio_cahvore.c`.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

use super::{Cahv, Cahvor, Cahvore, Camera, CameraModel, Imaging};
use crate::error::{Error, Result};
use crate::frames::Point3;

/// The keys that define the camera.
const KEYS: [&str; 9] = ["Model", "Dimensions", "C", "A", "H", "V", "O", "R", "E"];

/// Reads a text camera file; O is made unit.
///
/// `origin` is the file's name for messages. Errors name the line.
pub fn read_text(text: &str, origin: &Path) -> Result<Camera> {
    Ok(read_text_as_printed(text, origin)?.normalised())
}

/// Reads a text camera file, with its vectors as printed.
pub fn read_text_as_printed(text: &str, origin: &Path) -> Result<Camera> {
    read(text).map_err(|problem| Error::format(origin, problem))
}

/// Writes a camera as text; reading it returns the same numbers bit for bit (if O is unit).
pub fn write_text(camera: &Camera) -> String {
    let linear = camera.model.linear();
    let mut text = String::new();
    let mut line = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    line(format!("Model = {}", model_line(&camera.model)));
    line(format!("Dimensions = {} {}", camera.width(), camera.height()));
    line(vector_line("C", linear.centre.coords.as_slice()));
    line(vector_line("A", linear.axis.as_slice()));
    line(vector_line("H", linear.horizontal.as_slice()));
    line(vector_line("V", linear.vertical.as_slice()));
    match &camera.model {
        CameraModel::Cahv(_) => {}
        CameraModel::Cahvor(model) => {
            line(vector_line("O", model.optical_axis.as_slice()));
            line(vector_line("R", &model.radial));
        }
        CameraModel::Cahvore(model) => {
            line(vector_line("O", model.optical_axis.as_slice()));
            line(vector_line("R", &model.radial));
            line(vector_line("E", &model.pupil));
        }
    }
    text
}

fn model_line(model: &CameraModel) -> String {
    match model {
        CameraModel::Cahv(_) => "CAHV = perspective, linear".to_owned(),
        CameraModel::Cahvor(_) => "CAHVOR = perspective, distortion".to_owned(),
        CameraModel::Cahvore(model) => {
            let description = match model.imaging {
                Imaging::Perspective => "perspective, distortion, pupil",
                Imaging::Fisheye => "fish-eye",
                Imaging::General => "general",
            };
            // The parameter is unused in the other two laws, but it is kept if it was given.
            let parameter = match (model.imaging, model.linearity_parameter) {
                (Imaging::Perspective | Imaging::Fisheye, 0.0) => String::new(),
                (_, parameter) => format!(",{parameter}"),
            };
            format!("CAHVORE{}{parameter} = {description}", u8::from(model.imaging))
        }
    }
}

fn vector_line(name: &str, numbers: &[f64]) -> String {
    numbers.iter().fold(format!("{name} ="), |mut line, number| {
        // Writing to a string cannot fail.
        let _ = write!(line, " {number}");
        line
    })
}

/// The value of a key, with the number of its first line.
struct Entry {
    line: usize,
    value: String,
}

/// The kind of model given in the first line.
enum Kind {
    Cahv,
    Cahvor,
    Cahvore(Imaging, f64),
}

fn read(text: &str) -> Result<Camera, String> {
    let entries = entries(text)?;
    let vector = |key: &str| numbers::<3>(&entries, key);
    let kind = kind(entry(&entries, "Model")?)?;
    let size = size(entry(&entries, "Dimensions")?)?;
    let linear = Cahv::as_printed(
        Point3::from(vector("C")?),
        vector("A")?.into(),
        vector("H")?.into(),
        vector("V")?.into(),
    );
    let model = match kind {
        Kind::Cahv => CameraModel::Cahv(linear),
        Kind::Cahvor => CameraModel::Cahvor(Cahvor::as_printed(linear, vector("O")?.into(), vector("R")?)),
        Kind::Cahvore(imaging, parameter) => CameraModel::Cahvore(Cahvore::as_printed(
            linear,
            vector("O")?.into(),
            vector("R")?,
            vector("E")?,
            (imaging, parameter),
        )),
    };
    model.validate()?;
    Ok(Camera { model, size })
}

/// All `key = value` lines; a line without `=` continues the value before it.
fn entries(text: &str) -> Result<HashMap<String, Entry>, String> {
    let mut entries: HashMap<String, Entry> = HashMap::new();
    let mut last: Option<String> = None;
    for (index, raw) in text.lines().enumerate() {
        let line = index + 1;
        let content = raw.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        if let Some((key, value)) = content.split_once('=') {
            let key = key.trim().to_owned();
            let entry = Entry { line, value: value.trim().to_owned() };
            let first = entries.insert(key.clone(), entry);
            if let Some(first) = first.filter(|_| KEYS.contains(&key.as_str())) {
                return Err(format!("line {line} gives {key} again; it was given in line {}", first.line));
            }
            last = Some(key);
        } else {
            let Some(entry) = last.as_ref().and_then(|key| entries.get_mut(key)) else {
                return Err(format!(
                    "line {line} is {content:?}, but a line such as \"C = x y z\" is expected"
                ));
            };
            entry.value.push(' ');
            entry.value.push_str(content);
        }
    }
    Ok(entries)
}

fn entry<'a>(entries: &'a HashMap<String, Entry>, key: &str) -> Result<&'a Entry, String> {
    entries.get(key).ok_or_else(|| format!("there is no line \"{key} = …\", which a camera file needs"))
}

fn numbers<const N: usize>(entries: &HashMap<String, Entry>, key: &str) -> Result<[f64; N], String> {
    let Entry { line, value } = entry(entries, key)?;
    let parsed: Option<Vec<f64>> =
        value.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    parsed
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("line {line}: {key} must be {N} numbers, but it is {value:?}"))
}

fn size(Entry { line, value }: &Entry) -> Result<[u32; 2], String> {
    let parsed: Option<Vec<u32>> = value.split_whitespace().map(|word| word.parse().ok()).collect();
    parsed
        .and_then(|numbers| numbers.try_into().ok())
        .filter(|size: &[u32; 2]| size.iter().all(|&side| side > 0))
        .ok_or_else(|| {
            format!("line {line}: Dimensions must be width and height in pixels, but it is {value:?}")
        })
}

fn kind(Entry { line, value }: &Entry) -> Result<Kind, String> {
    // Text after a second "=" is a description for people.
    let name = value.split('=').next().unwrap_or_default().replace(char::is_whitespace, "");
    let (family, parameter) = name.split_once(',').unwrap_or((&name, ""));
    let imaging = match (family, parameter) {
        ("CAHV", "") => return Ok(Kind::Cahv),
        ("CAHVOR", "") => return Ok(Kind::Cahvor),
        ("CAHVORE1", _) => Imaging::Perspective,
        ("CAHVORE2", _) => Imaging::Fisheye,
        ("CAHVORE3", _) => Imaging::General,
        _ => {
            return Err(format!(
                "line {line}: the model is {name:?}, \
                 but it must be CAHV, CAHVOR, CAHVORE1, CAHVORE2 or CAHVORE3,P"
            ));
        }
    };
    match parameter.parse::<f64>() {
        Ok(linearity) if linearity.is_finite() => Ok(Kind::Cahvore(imaging, linearity)),
        _ if parameter.is_empty() && imaging != Imaging::General => Ok(Kind::Cahvore(imaging, 0.0)),
        _ => Err(format!(
            "line {line}: {family} is followed by {parameter:?}, not by its linearity as in \"CAHVORE3,0.37\""
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::all_kinds;
    use super::*;
    use crate::frames::Vector3;

    const JPL: &str = "# made by CCALADJ\n\nModel = CAHVORE3,0.37 = general\n\nDimensions = 1024 768\n\n\
        C =      0.609331000     -0.041064000     -0.233849000\nA = 0.703447 -0.005161 0.710729\n\
        H = 351.362 452.204 353.494\nV=35.8065 -1.75143\n  682.705\nO = 0.704402 -0.006062 0.709775\n\
        R = 3e-06 -0.012015 -0.007525\nE = 0.001442 0.001522 0.000483\n\n\
        S =\n 0 0 0\n 0 0 0\n\nHs    =    454.77\nTheta = -1.57 (-90.02 deg)\n\nS internal =\n 0 0\n";

    fn message(text: &str) -> String {
        read_text(text, Path::new("left.cahvore")).unwrap_err().to_string()
    }

    #[test]
    fn text_gives_every_model_back_bit_for_bit() {
        let mut cameras = all_kinds().to_vec();
        for (imaging, parameter) in [(Imaging::Perspective, 0.0), (Imaging::Fisheye, 0.1)] {
            let mut camera = cameras[2].clone();
            let CameraModel::Cahvore(model) = &mut camera.model else { panic!("{camera:?}") };
            (model.imaging, model.linearity_parameter) = (imaging, parameter);
            cameras.push(camera);
        }
        for camera in cameras {
            let text = write_text(&camera);
            assert_eq!(read_text(&text, Path::new("memory")).unwrap(), camera, "{text}");
        }
    }

    #[test]
    fn a_file_of_jpl_is_read_with_its_covariances_skipped() {
        let camera = read_text_as_printed(JPL, Path::new("left.cahvore")).unwrap();
        assert_eq!(camera.size, [1024, 768]);
        let CameraModel::Cahvore(model) = &camera.model else { panic!("{camera:?}") };
        assert_eq!(model.linear.vertical, Vector3::new(35.8065, -1.75143, 682.705));
        assert_eq!((model.imaging, model.linearity_parameter), (Imaging::General, 0.37));
        assert_eq!(model.pupil, [0.001442, 0.001522, 0.000483]);
        let normalised = read_text(JPL, Path::new("left.cahvore")).unwrap();
        assert!((normalised.model.optical_axis().norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn bad_text_is_answered_with_one_sentence_that_names_the_line() {
        let cases = [
            ("A = 0.703447 -0.005161 0.710729", "A = 0.703447 zero 0.710729", "line 8: A must be 3 numbers"),
            ("A = 0.703447 -0.005161 0.710729", "A = 0.703447 -0.005161", "line 8: A must be 3 numbers"),
            ("A = 0.703447 -0.005161 0.710729", "A = NaN 0 1", "line 8: A must be 3 numbers"),
            ("A = 0.703447 -0.005161 0.710729", "A = 7 0 1", "vector A has length"),
            ("Dimensions = 1024 768", "Dimensions = 1024", "line 5: Dimensions must be"),
            ("Dimensions = 1024 768", "Dimensions = 0 768", "line 5: Dimensions must be"),
            ("CAHVORE3,0.37", "CAHVORE3", "line 3: CAHVORE3 is followed by \"\""),
            ("CAHVORE3,0.37", "CAHVORE1,x", "line 3: CAHVORE1 is followed by \"x\""),
            ("CAHVORE3,0.37", "PSPH", "line 3: the model is \"PSPH\""),
            ("E = 0.001442", "C = 0.001442", "line 14 gives C again; it was given in line 7"),
            ("# made by CCALADJ", "made by CCALADJ", "line 1 is \"made by CCALADJ\""),
            ("E = 0.001442", "e = 0.001442", "there is no line \"E = …\""),
        ];
        for (good, bad, expected) in cases {
            assert!(JPL.contains(good));
            let message = message(&JPL.replace(good, bad));
            assert!(message.starts_with("left.cahvore: ") && message.contains(expected), "{message}");
            assert!(!message.contains('\n'));
        }
    }
}
