//! How soon computations end once they are cancelled.
//!
//! Each computation is carried out once to its end, then again and again, cancelled at moments spread evenly over that
//! time. The latency is the time from the request to the return; a computation that ended by itself before says nothing.
//! Times are of this machine. Unit: s.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A computation that can be cancelled; what it returns does not matter.
pub type Work<'a> = Box<dyn Fn(&AtomicBool) + Sync + 'a>;

/// The latencies of one computation.
#[derive(Clone, Debug, PartialEq)]
pub struct Latency {
    /// The computation.
    pub name: String,
    /// Its time when nobody cancels it, s.
    pub whole_s: f64,
    /// The times from request to return, s, smallest first.
    pub latencies_s: Vec<f64>,
}

/// Cancels `work` at `moments` moments.
pub fn measure(name: &str, work: &Work<'_>, moments: u32) -> Latency {
    let begun = Instant::now();
    work(&AtomicBool::new(false));
    let whole = begun.elapsed();
    let mut latencies_s: Vec<f64> = (0..moments)
        .filter_map(|moment| {
            cancelled_at(work, whole.mul_f64((f64::from(moment) + 0.5) / f64::from(moments)))
        })
        .map(|latency| latency.as_secs_f64())
        .collect();
    latencies_s.sort_by(f64::total_cmp);
    Latency { name: name.to_owned(), whole_s: whole.as_secs_f64(), latencies_s }
}

/// The time from the request at `moment` to the return of `work`; `None` where it had returned before.
fn cancelled_at(work: &Work<'_>, moment: Duration) -> Option<Duration> {
    let flag = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let working = scope.spawn(|| work(&flag));
        std::thread::sleep(moment);
        if working.is_finished() {
            return None;
        }
        let asked = Instant::now();
        flag.store(true, Ordering::Relaxed);
        while !working.is_finished() {
            std::thread::sleep(Duration::from_micros(200));
        }
        Some(asked.elapsed())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latency_is_the_time_after_the_request() {
        let work: Work<'_> = Box::new(|cancel| {
            let begun = Instant::now();
            while !cancel.load(Ordering::Relaxed) && begun.elapsed() < Duration::from_millis(200) {
                std::thread::sleep(Duration::from_millis(1));
            }
            if cancel.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(30));
            }
        });
        let found = measure("waits", &work, 4);
        assert!(found.whole_s >= 0.2 && !found.latencies_s.is_empty(), "{found:?}");
        assert!(found.latencies_s[0] >= 0.03, "{found:?}");
    }
}
