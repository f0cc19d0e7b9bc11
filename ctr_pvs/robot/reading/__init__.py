"""What robot files may say in other words: other units, other names for the same thing, tables, files of others."""
