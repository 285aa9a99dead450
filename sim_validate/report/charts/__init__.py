"""Charts of reports: each module draws what one kind of figure says."""
