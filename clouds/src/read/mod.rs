//! Point clouds in files, one format a file.
