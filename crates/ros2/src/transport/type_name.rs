use std::fmt;

/// The type of a message or of a service: `sensor_msgs` and `PointCloud2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TypeName {
    pub package: &'static str,
    pub name: &'static str,
}

impl TypeName {
    pub const fn new(package: &'static str, name: &'static str) -> Self {
        Self { package, name }
    }

    /// The type of a message as DDS has it.
    pub fn of_message(&self) -> String {
        format!("{}::msg::dds_::{}_", self.package, self.name)
    }

    /// The type of a service as DDS has it, where it ends in `Request_` and `Response_`.
    pub fn of_service(&self) -> String {
        format!("{}::srv::dds_::{}_", self.package, self.name)
    }
}

impl fmt::Display for TypeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.package, self.name)
    }
}
