use super::attachment::Attachment;
use super::cdr;
use anyhow::{Context as _, anyhow};
use serde::{Serialize, de::DeserializeOwned};
use zenoh::Wait as _;
use zenoh::key_expr::KeyExpr;
use zenoh::query::Query;

/// Answers a request, and tells who asks in a wrong way what is wrong.
pub fn respond<Q: DeserializeOwned, A: Serialize>(query: &Query, key: &KeyExpr<'_>, answer: impl Fn(Q) -> A) {
    let replied = match response(query, answer) {
        Ok((bytes, attachment)) => query.reply(key, bytes).attachment(attachment.to_bytes()).wait(),
        Err(error) => {
            log::debug!("{key}: a request cannot be read: {error:#}");
            query.reply_err(format!("{error:#}")).wait()
        }
    };
    if let Err(error) = replied {
        log::warn!("{key}: not answered: {error}");
    }
}

fn response<Q: DeserializeOwned, A: Serialize>(
    query: &Query,
    answer: impl Fn(Q) -> A,
) -> anyhow::Result<(Vec<u8>, Attachment)> {
    let attachment = query.attachment().map(|bytes| bytes.to_bytes());
    let asked = attachment.and_then(|bytes| Attachment::from_bytes(&bytes));
    let asked = asked.ok_or_else(|| anyhow!("a request needs the attachment of rmw_zenoh"))?;
    let payload = query.payload().ok_or_else(|| anyhow!("a request needs a payload"))?;
    let request = cdr::decode(&payload.to_bytes()).context("the request")?;
    // The response has the number and the gid of the request.
    let bytes = cdr::encode(&answer(request))?;
    Ok((bytes, Attachment::now(asked.number, asked.gid)))
}
