use anyhow::{Result, ensure};

/// Puts text into a page, between the marks of a section: what was there before goes, all else stays.
///
/// # Errors
///
/// Marks that are missing, double or in the wrong order.
pub fn with_section(page: &str, section: &str, text: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- {section}: measured -->\n"), format!("<!-- {section}: end -->\n"));
    for mark in [&begin, &end] {
        let count = page.matches(mark.as_str()).count();
        ensure!(count == 1, "the page has the line {} {count} times; it needs it once", mark.trim_end());
    }
    let (before, rest) = page.split_once(&begin).unwrap_or_default();
    let Some((_, after)) = rest.split_once(&end) else {
        anyhow::bail!("the page has the line {} before {}", end.trim_end(), begin.trim_end());
    };
    Ok([before, &begin, text, &end, after].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# A\n<!-- a: measured -->\nold\n<!-- a: end -->\nprose\n";

    #[test]
    fn only_the_section_is_replaced() {
        let page = with_section(PAGE, "a", "new\n").unwrap();
        assert_eq!(page, PAGE.replace("old", "new"));
        assert_eq!(with_section(&page, "a", "old\n").unwrap(), PAGE);
    }

    #[test]
    fn marks_that_are_missing_double_or_in_the_wrong_order_are_errors() {
        assert!(with_section(PAGE, "b", "").is_err());
        assert!(with_section(&PAGE.repeat(2), "a", "").is_err());
        assert!(with_section("<!-- a: end -->\n<!-- a: measured -->\n", "a", "").is_err());
    }
}
