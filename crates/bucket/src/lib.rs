//! Maps in the buckets of object stores: `s3://`, `gs://`, `az://`, and read-only `https://`.
//!
//! ```text
//! push  map folder -> files of a flush -> parts, named by content -> pages -> manifest, written last
//! read  manifest -> BucketDisk, a `Disk` that reads the URL, and this machine's disk for other paths -> MapReader
//! fetch objects below a URL -> files in a temporary folder -> readers of scans
//! pull  manifest -> MAP.unfinished, which keeps files that are already complete -> MAP
//! ```
//!
//! | module | content |
//! |---|---|
//! | `bucket` | [`Bucket`]: reads and writes objects; every error names its object |
//! | `request`, `store_health` | one request: attempts, progress, timeout, reports of a long wait |
//! | `pending` | a request that runs concurrently with others |
//! | `content` | downloads of objects, continued after a broken connection |
//! | `remote_store`, `counting_client` | stores by URL, and an HTTP client that counts the bytes it sends |
//! | `object_name` | names of objects: the BLAKE3 of their content |
//! | `manifest` | the only object that changes: the files of the map, and the pages of tile files |
//! | `file_list` | the list of files, with a cache of pages |
//! | `bucket_disk`, `part_reader`, `part_cache` | a map in a bucket as a read-only disk |
//! | `fetched_files`, `file_fetch` | downloads of scans and other files |
//! | `known_parts` | parts of kept scans that a push need not read |
//! | `known_states` | the states of a map that were pushed from its folder or pulled into it |
//! | `push`, `sender`, `prune`, `pull` | transfer of maps to buckets and back |
//!
//! `docs/format.md` describes the objects.

mod bucket;
mod bucket_disk;
mod content;
mod counting_client;
mod fetched_files;
mod file_fetch;
mod file_list;
mod known_parts;
mod known_states;
mod manifest;
mod object_name;
mod part_cache;
mod part_reader;
mod pending;
mod prune;
mod pull;
mod push;
mod remote_store;
mod request;
mod sender;
mod store_health;

/// The crate of the stores for [`Bucket::on`], in the version that voxtile uses.
pub use ::object_store;
pub use bucket::Bucket;
pub use bucket_disk::BucketDisk;
pub use fetched_files::FetchedFiles;
pub use pull::{Pulled, pull};
pub use push::{PushOptions, Pushed, push};
