"""Subcommands about robots themselves: what one is (info), and one from another code's file (convert)."""
