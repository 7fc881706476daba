//! The octree.
