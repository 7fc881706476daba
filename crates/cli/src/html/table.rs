use std::fmt::Display;
use std::io::{self, Write};

/// Begins a table below a heading. A column name with a leading # is numeric.
pub fn begin_table(out: &mut impl Write, heading: &str, columns: &[&str]) -> io::Result<()> {
    write!(out, "<h2>{heading}</h2>\n<div class=\"scroll\"><table>")?;
    if !columns.is_empty() {
        write!(out, "<thead><tr>")?;
        for column in columns {
            match column.strip_prefix('#') {
                Some(name) => write!(out, "<th class=\"number\">{name}</th>")?,
                None => write!(out, "<th>{column}</th>")?,
            }
        }
        write!(out, "</tr></thead>")?;
    }
    writeln!(out, "<tbody>")
}

pub fn end_table(out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "</tbody></table></div>")
}

pub fn row(out: &mut impl Write, name: &str, value: impl Display) -> io::Result<()> {
    writeln!(out, "<tr><th>{name}</th><td>{value}</td></tr>")
}

pub fn number_cell(out: &mut impl Write, value: impl Display) -> io::Result<()> {
    write!(out, "<td class=\"number\">{value}</td>")
}
