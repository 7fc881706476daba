use super::attachment::{Attachment, BYTES as ATTACHMENT_BYTES};
use super::cdr;
use anyhow::{Context as _, anyhow};
use serde::{Serialize, de::DeserializeOwned};
use zenoh::Wait as _;
use zenoh::key_expr::KeyExpr;
use zenoh::query::Query;

/// Returns the memory of a queued request. Returns `None` if its attachment is not one of `rmw_zenoh_cpp`, because it
/// may have any size.
pub fn waiting_bytes(query: &Query) -> Option<usize> {
    let attachment = query.attachment().map_or(0, |attachment| attachment.len());
    let is_ours = attachment == 0 || attachment == ATTACHMENT_BYTES;
    let payload = query.payload().map_or(0, |payload| payload.len());
    is_ours.then(|| payload.saturating_add(attachment).saturating_add(query.parameters().as_str().len()))
}

/// Answers a request. An invalid request gets an error response.
pub fn respond<Q: DeserializeOwned, A: Serialize>(query: &Query, key: &KeyExpr<'_>, answer: impl Fn(Q) -> A) {
    let replied = match response(query, answer) {
        Ok((bytes, attachment)) => query.reply(key, bytes).attachment(attachment.to_bytes()).wait(),
        Err(error) => {
            log::debug!("{key}: cannot read a request: {error:#}");
            query.reply_err(format!("{error:#}")).wait()
        }
    };
    if let Err(error) = replied {
        log::warn!("{key}: cannot send the response: {error}");
    }
}

fn response<Q: DeserializeOwned, A: Serialize>(
    query: &Query,
    answer: impl Fn(Q) -> A,
) -> anyhow::Result<(Vec<u8>, Attachment)> {
    let attachment = query.attachment().map(|bytes| bytes.to_bytes());
    let request_id = attachment.and_then(|bytes| Attachment::from_bytes(&bytes));
    let request_id = request_id.ok_or_else(|| anyhow!("the request has no rmw_zenoh_cpp attachment"))?;
    let payload = query.payload().ok_or_else(|| anyhow!("the request has no payload"))?;
    let request = cdr::decode(&payload.to_bytes()).context("the request")?;
    // The response repeats the number and the GID of the request.
    let bytes = cdr::encode(&answer(request))?;
    Ok((bytes, Attachment::now(request_id.number, request_id.gid)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;
    use std::time::Duration;
    use zenoh::Config;

    /// Returns the memory of requests that were sent to a service in the same process.
    fn bytes_of(requests: &[(&str, usize, Option<usize>)]) -> Vec<Option<usize>> {
        let mut config = Config::default();
        for (key, value) in [("scouting/multicast/enabled", "false"), ("listen/endpoints", "[]")] {
            config.insert_json5(key, value).unwrap();
        }
        let session = zenoh::open(config).wait().unwrap();
        let (out, seen) = channel();
        let note = move |query: Query| out.send(waiting_bytes(&query)).unwrap();
        let _queryable = session.declare_queryable("service").callback(note).wait().unwrap();
        let ask = |&(selector, payload, attachment): &(&str, usize, Option<usize>)| {
            let attachment = attachment.map(|bytes| vec![0_u8; bytes]);
            session.get(selector).payload(vec![0_u8; payload]).attachment(attachment).wait().unwrap();
            seen.recv_timeout(Duration::from_secs(60)).unwrap()
        };
        requests.iter().map(ask).collect()
    }

    #[test]
    fn all_of_a_request_is_counted_and_other_attachments_are_refused() {
        let requests = [
            ("service", 10, Some(ATTACHMENT_BYTES)),
            ("service?a=123456", 10, Some(ATTACHMENT_BYTES)),
            ("service", 10, None),
            ("service", 10, Some(ATTACHMENT_BYTES - 1)),
            ("service", 10, Some(1 << 20)),
        ];
        assert_eq!(bytes_of(&requests), [Some(43), Some(51), Some(10), None, None]);
    }
}
