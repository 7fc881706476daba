use std::fmt;

/// Type of a message or service, such as `sensor_msgs` and `PointCloud2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TypeName {
    pub package: &'static str,
    pub name: &'static str,
}

impl TypeName {
    pub const fn new(package: &'static str, name: &'static str) -> Self {
        Self { package, name }
    }

    /// Returns the DDS name of a message type.
    pub fn of_message(&self) -> String {
        format!("{}::msg::dds_::{}_", self.package, self.name)
    }

    /// Returns the DDS name of a service type, to which DDS appends `Request_` or `Response_`.
    pub fn of_service(&self) -> String {
        format!("{}::srv::dds_::{}_", self.package, self.name)
    }
}

impl fmt::Display for TypeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.package, self.name)
    }
}
