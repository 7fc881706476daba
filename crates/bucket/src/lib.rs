//! Maps that lie in a bucket of an object store: `s3://`, `gs://`, `az://`, and `https://` for reading.
//!
//! ```text
//! push  map folder -> files as of a flush -> parts, named by content -> pages -> manifest, put last
//! read  manifest -> BucketDisk, a `Disk` that reads only -> MapReader and all that takes one
//! fetch objects below a URL -> files in a temporary folder -> what reads scans
//! pull  manifest -> MAP.unfinished, files whose content is there are kept -> MAP
//! ```
//!
//! | module | content |
//! |---|---|
//! | `bucket` | [`Bucket`]: gets and puts objects; every error names its object |
//! | `request`, `store_health` | one request: its attempts, its progress, the bound on it, reports of a long wait |
//! | `pending` | a request that goes on while others are made |
//! | `content` | content of objects, continued after a break |
//! | `remote_store`, `counting_client` | the stores of URLs, and a client that counts what it sends |
//! | `object_name` | objects are named by the BLAKE3 of their content |
//! | `manifest` | the one object that changes: which files the map has, by pages of tiles |
//! | `file_list` | the list of files, with the pages that were asked for |
//! | `bucket_disk`, `part_reader` | a map in a bucket as files that can be read |
//! | `fetched_files`, `file_fetch` | scans and other files of any bucket, for what reads files |
//! | `known_states` | what a folder builds on: the states that were pushed from it or pulled into it |
//! | `push`, `sender`, `prune`, `pull` | maps to buckets and back |
//!
//! `docs/format.md` describes the objects.

mod bucket;
mod bucket_disk;
mod content;
mod counting_client;
mod fetched_files;
mod file_fetch;
mod file_list;
mod known_states;
mod manifest;
mod object_name;
mod part_reader;
mod pending;
mod prune;
mod pull;
mod push;
mod remote_store;
mod request;
mod sender;
mod store_health;

/// The crate of [`Bucket::on`], in the version that voxtile uses.
pub use ::object_store;
pub use bucket::Bucket;
pub use bucket_disk::BucketDisk;
pub use fetched_files::FetchedFiles;
pub use pull::{Pulled, pull};
pub use push::{PushOptions, Pushed, push};
