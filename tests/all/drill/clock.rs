//! A clock that jumps.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::PoisonError;

use serde_json::json;
use sightline_tests::server::small_drive;

use super::{EXCLUSIVE, begin, has_ended, print_row, until};
use crate::persistence::ServerProcess;

/// Builds a preload library that shifts the clock by the seconds in the file `SIGHTLINE_CLOCK`; `None` without a C compiler.
fn library(folder: &Path) -> Option<PathBuf> {
    const SOURCE: &str = r#"
        #define _GNU_SOURCE
        #include <dlfcn.h>
        #include <stdio.h>
        #include <stdlib.h>
        #include <time.h>
        int clock_gettime(clockid_t id, struct timespec *time) {
            static int (*real)(clockid_t, struct timespec *);
            if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
            int result = real(id, time);
            const char *name = getenv("SIGHTLINE_CLOCK");
            long shift = 0;
            FILE *file = id == CLOCK_REALTIME && name ? fopen(name, "r") : NULL;
            if (file) { if (fscanf(file, "%ld", &shift) != 1) shift = 0; fclose(file); }
            time->tv_sec += shift;
            return result;
        }
    "#;
    let (source, library) = (folder.join("clock.c"), folder.join("libclock.so"));
    std::fs::write(&source, SOURCE).unwrap();
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-o"]).arg(&library).arg(&source).arg("-ldl");
    compiler.output().is_ok_and(|made| made.status.success()).then_some(library)
}

#[test]
#[cfg(target_os = "linux")]
fn drill_the_clock_jumps() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let Some(library) = library(data.path()) else {
        print_row("clock", "left out: there is no C compiler");
        return;
    };
    let shift = data.path().join("shift");
    // 50 years back (the HTTP library cannot write a date before 1970), one day forward, one hour back, 300 years forward.
    let shifts: [i64; 4] = [-1_577_880_000, 86_400, -3_600, 9_467_280_000];
    std::fs::write(&shift, shifts[0].to_string()).unwrap();
    let environment = [("LD_PRELOAD", library.as_os_str()), ("SIGHTLINE_CLOCK", shift.as_os_str())];
    let server = ServerProcess::start_with(&environment, drive.path(), &data.path().join("state"));
    let mut made = Vec::new();
    for seconds in shifts {
        std::fs::write(&shift, seconds.to_string()).unwrap();
        let session = begin(&server, 0);
        until(&server, &format!("sessions/{session}/targets/0/runs/0"), has_ended);
        let note =
            server.json("POST", &format!("sessions/{session}/notes"), &json!({ "step": 0, "text": "x" }));
        // Times of a recording are counted from 1970: an earlier one is refused with an error.
        let recording = format!("sessions/{session}/exports/recording.rrd");
        let (status, body) = server.answer("GET", &recording, "", "");
        assert!(status == 200 || seconds < 0 && body.contains("1970"), "{status}: {}", body.escape_debug());
        server.bytes(&format!("sessions/{session}/exports/report.html"));
        made.push(note["made"].as_str().unwrap().chars().take(10).collect::<String>());
    }
    assert_eq!(server.get("health")["notices"], json!([]));
    print_row("the clock jumps", &format!("sessions, runs, notes and exports at {}", made.join(", ")));
}
