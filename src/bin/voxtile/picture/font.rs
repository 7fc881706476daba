/// Columns of a letter; a row is a number whose highest bit is the left column.
pub const WIDTH: i64 = 5;
/// Rows of a letter.
pub const HEIGHT: i64 = 7;

/// The rows of a letter; what the pictures do not need is blank.
pub fn glyph(letter: char) -> [u8; HEIGHT as usize] {
    match letter {
        '0' => [14, 17, 19, 21, 25, 17, 14],
        '1' => [4, 12, 4, 4, 4, 4, 14],
        '2' => [14, 17, 1, 6, 8, 16, 31],
        '3' => [14, 17, 1, 6, 1, 17, 14],
        '4' => [2, 6, 10, 18, 31, 2, 2],
        '5' => [31, 16, 30, 1, 1, 17, 14],
        '6' => [6, 8, 16, 30, 17, 17, 14],
        '7' => [31, 1, 2, 4, 8, 8, 8],
        '8' => [14, 17, 17, 14, 17, 17, 14],
        '9' => [14, 17, 17, 15, 1, 2, 12],
        '.' => [0, 0, 0, 0, 0, 12, 12],
        '-' => [0, 0, 0, 14, 0, 0, 0],
        'm' => [0, 0, 26, 21, 21, 21, 21],
        'k' => [16, 16, 18, 20, 24, 20, 18],
        'x' => [0, 0, 17, 10, 4, 10, 17],
        'y' => [0, 0, 17, 17, 15, 1, 14],
        'z' => [0, 0, 31, 2, 4, 8, 31],
        _ => [0; HEIGHT as usize],
    }
}

/// Width in dots of a text.
pub fn width(text: &str) -> i64 {
    text.chars().count() as i64 * (WIDTH + 1) - 1
}
