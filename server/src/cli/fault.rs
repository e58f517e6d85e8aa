//! Faults on the command line: `KIND:FROM-TO[@TARGET]`.

use sightline_session::faults::NewFault;
use sightline_world::scenario::FaultKind;

/// Parses a fault.
///
/// # Errors
/// A sentence that describes the expected form.
pub(super) fn parse(text: &str) -> Result<NewFault, String> {
    let expected = || format!("{text} is not KIND:FROM-TO[@TARGET], for example occluder:5-7");
    let (kind, rest) = text.split_once(':').ok_or_else(expected)?;
    let kind = FaultKind::ALL.into_iter().find(|known| known.name() == kind).ok_or_else(|| {
        let names: Vec<&str> = FaultKind::ALL.iter().map(|known| known.name()).collect();
        format!("{kind} is no kind of fault; choose {}", names.join(", "))
    })?;
    let (stops, target) = match rest.split_once('@') {
        Some((stops, target)) => (stops, Some(target.parse::<usize>().map_err(|_| expected())?)),
        None => (rest, None),
    };
    let (from, to) = stops.split_once('-').unwrap_or((stops, stops));
    let stop = |text: &str| text.parse::<u32>().map_err(|_| expected());
    Ok(NewFault { kind, from_stop: stop(from)?, to_stop: stop(to)?, target })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_read_and_a_wrong_one_is_refused_in_one_sentence() {
        let fault = |kind, from_stop, to_stop, target| Ok(NewFault { kind, from_stop, to_stop, target });
        assert_eq!(parse("occluder:5-7"), fault(FaultKind::Occluder, 5, 7, None));
        assert_eq!(parse("shadow:8-9@1"), fault(FaultKind::Shadow, 8, 9, Some(1)));
        assert_eq!(parse("pose_jump:4"), fault(FaultKind::PoseJump, 4, 4, None));
        for wrong in ["occluder", "occluder:x-7", "shadow:8-9@", "occluder:5--7"] {
            assert!(parse(wrong).unwrap_err().contains("is not KIND:FROM-TO"), "{wrong}");
        }
        assert!(parse("rain:1-2").unwrap_err().contains("choose occluder, shadow"));
    }
}
