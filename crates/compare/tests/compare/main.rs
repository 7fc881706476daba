//! Tests of comparisons and frontiers.

mod epochs;
mod exact;
mod frontiers;
mod frontiers_in;
mod naive;
mod observations;
mod random_maps;
mod refused;
mod volumes;
mod write_epochs;
