//! Distance fields compared with a brute force, in memory, live and in folders.

mod fields;
mod folder;
mod live;
mod naive;
mod random_map;
mod recorded;
