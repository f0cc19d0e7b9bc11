"""ctr-pvs stability: margins, snaps and folds while one tube is turned, as text, JSON and pictures."""
