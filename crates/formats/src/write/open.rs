use super::counted::Counted;
#[cfg(feature = "e57")]
use super::e57;
use super::format::VoxelFileFormat;
#[cfg(feature = "ros")]
use super::mcap;
use super::options::WriteOptions;
#[cfg(feature = "parquet")]
use super::parquet;
use super::row::{VoxelSink, VoxelsHead};
use super::{Error, Result};
use super::{autoware, glb, heightmap, nav2, npz, xyz};
#[cfg(feature = "las")]
use super::{copc, las};
use std::path::Path;

/// Starts a file, or a folder where the format is one, at a path of its own. It is whole when the sink is finished.
///
/// Nothing is renamed, synchronised or removed: who calls does that. The folder of [`VoxelFileFormat::Autoware`] must
/// be empty or not there yet.
///
/// # Errors
///
/// A resolution, a box or options that make no sense; a format that this program was built without; the system refuses.
pub fn open_sink(
    format: VoxelFileFormat,
    head: &VoxelsHead,
    path: &Path,
    options: &WriteOptions,
) -> Result<Box<dyn VoxelSink>> {
    let wrong = |what: &str, reason: String| Err(Error::argument(what, reason));
    if !(head.resolution_m.is_finite() && head.resolution_m > 0.0) {
        return wrong("resolution", format!("{} m is no edge of a voxel", head.resolution_m));
    }
    let bounds = head.bounds_m.as_flattened();
    if head.voxels > 0 && !bounds.iter().all(|bound| bound.is_finite()) {
        return wrong("bounds", format!("{:?} is no box around the voxels", head.bounds_m));
    }
    let sink: Box<dyn VoxelSink> = match format {
        VoxelFileFormat::Xyz => Box::new(xyz::XyzSink::create(path)?),
        VoxelFileFormat::Npz => Box::new(npz::NpzSink::create(head, path, options)?),
        VoxelFileFormat::Nav2Map => Box::new(nav2::Nav2Sink::create(head, path, options)?),
        VoxelFileFormat::Heightmap => Box::new(heightmap::HeightmapSink::create(head, path, options)?),
        VoxelFileFormat::Glb => Box::new(glb::GlbSink::create(head, path, options)?),
        VoxelFileFormat::Autoware => Box::new(autoware::AutowareSink::create(head, path, options)?),
        #[cfg(feature = "las")]
        VoxelFileFormat::Las => Box::new(las::LasSink::create(head, path, options, false)?),
        #[cfg(feature = "las")]
        VoxelFileFormat::Laz => Box::new(las::LasSink::create(head, path, options, true)?),
        #[cfg(feature = "las")]
        VoxelFileFormat::Copc => Box::new(copc::CopcSink::create(head, path, options)?),
        #[cfg(feature = "e57")]
        VoxelFileFormat::E57 => Box::new(e57::E57Sink::create(path, options)?),
        #[cfg(feature = "parquet")]
        VoxelFileFormat::Parquet => Box::new(parquet::ParquetSink::create(head, path, options)?),
        #[cfg(feature = "ros")]
        VoxelFileFormat::Mcap => Box::new(mcap::McapSink::create(head, path, options)?),
        #[allow(unreachable_patterns)]
        other => {
            let feature = other.feature().unwrap_or_default();
            let reason = format!("this program was built without it; build with the feature `{feature}`");
            return wrong(other.name(), reason);
        }
    };
    Ok(Box::new(Counted::new(sink, options.final_path.clone(), head.voxels)))
}
