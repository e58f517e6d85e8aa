//! Tests of the lanes.

use super::*;
use std::sync::atomic::Ordering;
use std::sync::mpsc;
use std::time::Duration;

use crate::limits::Limits;

#[tokio::test]
async fn a_panicking_job_leaves_the_lane_working() {
    let lane = Lane::new(1, 8);
    let (sender, mut receiver) = tokio::sync::mpsc::unbounded_channel();
    lane.submit(|| panic!("meant")).unwrap();
    lane.submit(move || sender.send(7).unwrap()).unwrap();
    assert_eq!(receiver.recv().await, Some(7));
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_start_in_the_order_of_their_submission() {
    let lane = Lane::new(1, 64);
    let (sender, receiver) = mpsc::channel();
    for number in 0..50 {
        let sender = sender.clone();
        lane.submit(move || sender.send(number).unwrap()).unwrap();
    }
    drop(sender);
    let done = blocking(move || Ok(receiver.iter().collect::<Vec<_>>())).await.unwrap();
    assert_eq!(done, (0..50).collect::<Vec<_>>());
}

#[tokio::test(flavor = "multi_thread")]
async fn abandoned_work_keeps_its_permit_and_is_cancelled() {
    let lane = Lane::new(1, 8);
    let (begin, mut begun) = tokio::sync::mpsc::unbounded_channel();
    let (release, released) = mpsc::channel::<()>();
    let own = lane.clone();
    let request = tokio::spawn(async move {
        own.run_until_dropped(move |cancel| {
            begin.send(Arc::clone(cancel)).unwrap();
            released.recv().map_err(|closed| ApiError::internal(closed.to_string()))
        })
        .await
    });
    let flag = begun.recv().await.unwrap();
    assert!(!flag.load(Ordering::Relaxed));
    request.abort();
    assert!(request.await.unwrap_err().is_cancelled());
    assert!(flag.load(Ordering::Relaxed));
    assert_eq!(lane.permits.available_permits(), 0, "the work goes on");
    release.send(()).unwrap();
    assert_eq!(lane.run(|| Ok(3)).await, Ok(3));
}

#[tokio::test(flavor = "multi_thread")]
async fn overlong_work_is_cancelled_with_a_reason() {
    let mut limits = Limits::default();
    limits.set("step_s=1").unwrap();
    let lane = Lane::new(1, 1).with_time_limit(&Arc::new(limits));
    let until_told = |cancel: &CancelFlag| {
        while !cancel.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
        Err::<(), _>(sightline_geometry::error::Error::Cancelled.into())
    };
    let problem = lane.run_until_dropped(until_told).await.unwrap_err();
    assert_eq!((problem.problem().status, problem.problem().code.as_str()), (422, "too_long"));
    assert!(problem.problem().hint.as_ref().unwrap().contains("--limit step_s=2"), "{problem:?}");
    assert_eq!(lane.run_until_dropped(|_| Ok(3)).await, Ok(3));
}

#[tokio::test(flavor = "multi_thread")]
async fn multi_turn_jobs_alternate() {
    let lane = Lane::new(1, 8);
    let (sender, receiver) = mpsc::channel();
    let (release, released) = mpsc::channel::<()>();
    // No job starts before all are in the queue.
    lane.submit(move || released.recv().unwrap()).unwrap();
    for name in ["a", "b", "c"] {
        let (sender, mut turns) = (sender.clone(), 0..3);
        lane.submit_by_turns(&Position::default(), move || match turns.next() {
            Some(turn) => {
                sender.send(format!("{name}{turn}")).unwrap();
                ControlFlow::Continue(())
            }
            None => ControlFlow::Break(()),
        })
        .unwrap();
    }
    drop(sender);
    release.send(()).unwrap();
    let done = blocking(move || Ok(receiver.iter().collect::<Vec<_>>())).await.unwrap();
    assert_eq!(done, ["a0", "b0", "c0", "a1", "b1", "c1", "a2", "b2", "c2"]);
    assert!(lane.queue.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_waiting_job_reports_its_queue_position() {
    let lane = Lane::new(1, 8);
    let (release, released) = mpsc::channel::<()>();
    lane.submit(move || released.recv().unwrap()).unwrap();
    let positions = [Position::default(), Position::default()];
    let (sender, receiver) = mpsc::channel();
    for position in &positions {
        let sender = sender.clone();
        lane.submit_by_turns(position, move || {
            sender.send(()).unwrap();
            ControlFlow::Break(())
        })
        .unwrap();
    }
    assert_eq!(positions.each_ref().map(|position| lane.jobs_ahead(position)), [Some(1), Some(2)]);
    drop(sender);
    release.send(()).unwrap();
    blocking(move || Ok(receiver.iter().count())).await.unwrap();
    assert_eq!(positions.each_ref().map(|position| lane.jobs_ahead(position)), [None, None]);
}

#[tokio::test]
async fn a_full_lane_refuses_at_once() {
    let lane = Lane::new(0, 2);
    assert!(lane.submit(|| ()).is_ok() && lane.submit(|| ()).is_ok());
    assert_eq!(lane.submit(|| ()).unwrap_err().problem().status, 503);
}

#[tokio::test]
async fn a_lane_rejects_surplus_work_and_hides_a_panic() {
    let lane = Lane::new(1, 1);
    assert_eq!(lane.run(|| Ok(3)).await, Ok(3));
    let problem = lane.run::<()>(|| panic!("secret")).await.unwrap_err();
    assert_eq!(problem.problem().code, "internal");
    assert!(!problem.problem().detail.contains("secret"));
    assert_eq!(Lane::new(1, 0).run(|| Ok(())).await.unwrap_err().problem().status, 503);
}
