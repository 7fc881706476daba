use super::Text;
use std::io::{self, Write};

const STYLE: &str = include_str!("style.css");

/// Begins a page as HTML that is also valid XML: its title in the browser, the heading, and a line below.
pub fn begin_page(out: &mut impl Write, title: &str, heading: &str, line: &str) -> io::Result<()> {
    let [title, heading, line] = [title, heading, line].map(Text);
    writeln!(
        out,
        "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n\
         <meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{heading}</h1>\n\
         <p class=\"faint\">{line}</p>"
    )
}

pub fn end_page(out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "</body>\n</html>")
}
