//! Tests of comparisons and frontiers.

mod exact;
mod frontiers;
mod naive;
mod random_maps;
mod refused;
