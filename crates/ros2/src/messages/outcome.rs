use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// Response of `std_srvs/Trigger`, and of voxtile's own services that succeed or fail with a reason.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    pub success: bool,
    pub message: String,
}

impl Message for Outcome {}

impl From<Result<String, String>> for Outcome {
    fn from(result: Result<String, String>) -> Self {
        let success = result.is_ok();
        let (Ok(message) | Err(message)) = result;
        Self { success, message }
    }
}
