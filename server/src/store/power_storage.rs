//! An in-memory storage that records all operations and can refuse them, like a full or failing disk.

use std::io::{Error as IoError, ErrorKind, Result as IoResult};
use std::ops::Bound;
use std::path::Path;
use std::sync::{Arc, Mutex};

use redb::{BackendError, StorageBackend};

use super::disk::{Disk, Opener, Outcome};
use super::open::{builder, prepare};
use super::{FILE_NAME, Store};
use crate::jobs::lock;

/// Unit that a disk writes atomically, bytes.
const SECTOR: usize = 512;

/// An operation on a storage.
#[derive(Clone)]
pub(super) enum Op {
    Write(u64, Vec<u8>),
    Length(u64),
    Sync,
    /// The program has acknowledged a request.
    Acknowledged,
}

/// An in-memory storage that records every operation and can fail.
#[derive(Clone, Default)]
pub(super) struct Storage(pub(super) Arc<Mutex<Content>>);

#[derive(Default)]
pub(super) struct Content {
    pub(super) bytes: Vec<u8>,
    pub(super) ops: Vec<Op>,
    /// Number of successful operations before the failure, number of failing operations, and their error.
    pub(super) failure: Option<(usize, usize, ErrorKind)>,
    pub(super) failed: usize,
}

impl std::fmt::Debug for Storage {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str("Storage")
    }
}

impl Storage {
    pub(super) fn of(bytes: Vec<u8>) -> Self {
        Self(Arc::new(Mutex::new(Content { bytes, ..Content::default() })))
    }

    fn opener(&self) -> Opener {
        let storage = self.clone();
        Box::new(move || builder().create_with_backend(storage.clone()))
    }

    /// A store on this storage.
    pub(super) fn store(&self, folder: &Path) -> Outcome<Store> {
        let opener = self.opener();
        let database = opener()?;
        prepare(&database)?;
        let store = Store::on(Disk::new(folder.join(FILE_NAME), database, opener)?, Vec::new());
        Ok(store.expect("a thread"))
    }

    fn change(&self, op: Op) -> IoResult<()> {
        let mut content = lock(&self.0);
        if let Some((before, fail, kind)) = &mut content.failure {
            match (before, fail) {
                (0, 0) => {}
                (0, fail) => {
                    *fail -= 1;
                    let kind = *kind;
                    content.failed += 1;
                    return Err(IoError::new(kind, "refused by the test"));
                }
                (before, _) => *before -= 1,
            }
        }
        op.apply(&mut content.bytes, |_| true);
        content.ops.push(op);
        Ok(())
    }
}

impl Op {
    /// Applies the operation to `bytes`; of a write, only the sectors selected by `is_written`.
    pub(super) fn apply(&self, bytes: &mut Vec<u8>, is_written: impl Fn(usize) -> bool) {
        match self {
            Self::Write(at, data) => {
                let end = *at as usize + data.len();
                bytes.resize(bytes.len().max(end), 0);
                for (number, part) in
                    data.chunks(SECTOR).enumerate().filter(|(number, _)| is_written(*number))
                {
                    let from = *at as usize + number * SECTOR;
                    bytes[from..from + part.len()].copy_from_slice(part);
                }
            }
            Self::Length(length) => bytes.resize(*length as usize, 0),
            Self::Sync | Self::Acknowledged => {}
        }
    }
}

impl StorageBackend for Storage {
    fn len(&self) -> IoResult<u64> {
        Ok(lock(&self.0).bytes.len() as u64)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> IoResult<()> {
        let content = lock(&self.0);
        let part = content.bytes.get(offset as usize..offset as usize + out.len());
        out.copy_from_slice(part.ok_or(ErrorKind::UnexpectedEof)?);
        Ok(())
    }

    fn set_len(&self, length: u64) -> IoResult<()> {
        self.change(Op::Length(length))
    }

    fn sync_data(&self) -> IoResult<()> {
        self.change(Op::Sync)
    }

    fn write(&self, offset: u64, data: &[u8]) -> IoResult<()> {
        self.change(Op::Write(offset, data.to_vec()))
    }

    fn try_lock_range(&self, _: Bound<u64>, _: Bound<u64>) -> std::result::Result<bool, BackendError> {
        Ok(true)
    }

    fn try_lock_shared_range(&self, _: Bound<u64>, _: Bound<u64>) -> std::result::Result<bool, BackendError> {
        Ok(true)
    }

    fn lock_range(&self, _: Bound<u64>, _: Bound<u64>) -> std::result::Result<(), BackendError> {
        Ok(())
    }

    fn lock_shared_range(&self, _: Bound<u64>, _: Bound<u64>) -> std::result::Result<(), BackendError> {
        Ok(())
    }

    fn unlock_range(&self, _: Bound<u64>, _: Bound<u64>) -> std::result::Result<(), BackendError> {
        Ok(())
    }

    fn query_lock_range(&self, _: Bound<u64>, _: Bound<u64>) -> std::result::Result<bool, BackendError> {
        Ok(false)
    }
}
