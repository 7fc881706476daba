use crate::transport::TypeName;

/// Returns the hash of a type (REP 2011), which is part of keys; `None` for a type that the node does not use.
pub fn type_hash(kind: TypeName) -> Option<&'static str> {
    HASHES.iter().find(|(known, _)| *known == kind).map(|(_, hash)| *hash)
}

/// Hashes of all types that the node uses. `tests/type_hashes.py` computes them from the definitions and compares.
const HASHES: [(TypeName, &str); 18] = [
    (
        TypeName::new("sensor_msgs", "PointCloud2"),
        "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    ),
    (
        TypeName::new("tf2_msgs", "TFMessage"),
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    ),
    (
        TypeName::new("nav_msgs", "Odometry"),
        "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    ),
    (
        TypeName::new("nav_msgs", "Path"),
        "RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    ),
    (
        TypeName::new("octomap_msgs", "Octomap"),
        "RIHS01_9891a19a05b70ec20aa8f45db3f8300b9ab80afff32c61c549d25087da9625b0",
    ),
    (
        TypeName::new("visualization_msgs", "MarkerArray"),
        "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    ),
    (
        TypeName::new("nav_msgs", "OccupancyGrid"),
        "RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    ),
    (
        TypeName::new("geometry_msgs", "PoseArray"),
        "RIHS01_af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0",
    ),
    (
        TypeName::new("diagnostic_msgs", "DiagnosticArray"),
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    ),
    (
        TypeName::new("std_srvs", "Trigger"),
        "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
    ),
    (
        TypeName::new("std_srvs", "Empty"),
        "RIHS01_5888399dedec5ccc85ea6451949fd2c9f97bfdf963f9a588821639fcd31b5d19",
    ),
    (
        TypeName::new("octomap_msgs", "BoundingBoxQuery"),
        "RIHS01_5115fa060b6e9c8f7b1dba63dc318f4308e60ab936eede0986385768787dbe23",
    ),
    (
        TypeName::new("octomap_msgs", "GetOctomap"),
        "RIHS01_c43f2ceb835f797f3d2a2c3d9000e4691207d8c7bfb443119b4e90daaabb5d6c",
    ),
    (
        TypeName::new("voxtile_msgs", "Snapshot"),
        "RIHS01_3d33f0d55aa96d205bf07deb060b4c29f597efee6fbfafd3f4ada518c1705731",
    ),
    (
        TypeName::new("voxtile_msgs", "GetOctomapInBox"),
        "RIHS01_33c116c4d55254c66b43f360786839bad5b69a9e57c2f787755a38f103a05de1",
    ),
    (
        TypeName::new("voxtile_msgs", "CastRay"),
        "RIHS01_f947f98986371847ae08a9cdb69666a24505095191457157bad46d2b0b826ae1",
    ),
    (
        TypeName::new("voxtile_msgs", "CheckCollision"),
        "RIHS01_8f410b4fb8207cbeb368649a39cfe498d49aa8c1ab344f2e7b6d9bc8e62edfd4",
    ),
    (
        TypeName::new("nvblox_msgs", "EsdfAndGradients"),
        "RIHS01_e080f96a14304e6d24c9598b72b80e0aa20a2cfc1bbc2414a629c907a10eb5b0",
    ),
];
