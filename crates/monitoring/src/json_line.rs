use crate::time_text::time_text;
use log::Record;
use std::time::SystemTime;

/// Returns a log record as a JSON object without a line break: `time` (RFC 3339, UTC), `level` (`error` to `trace`),
/// `target` (the module) and `message`.
pub fn json_line(record: &Record<'_>, time: SystemTime) -> String {
    let object = serde_json::json!({
        "time": time_text(time),
        "level": record.level().as_str().to_ascii_lowercase(),
        "target": record.target(),
        "message": record.args().to_string(),
    });
    object.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::UNIX_EPOCH;

    #[test]
    fn a_message_of_several_lines_is_one_line() {
        let message = "first \"line\"\nsecond";
        let arguments = format_args!("{message}");
        let record = Record::builder().level(log::Level::Warn).target("a::b").args(arguments).build();
        let line = json_line(&record, UNIX_EPOCH);
        assert!(!line.contains('\n'));
        let object: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert_eq!(
            object,
            serde_json::json!({
                "time": "1970-01-01T00:00:00.000Z", "level": "warn", "target": "a::b", "message": message
            })
        );
    }
}
