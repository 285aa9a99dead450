"""What people see of a run: charts, and a folder of pages that opens from disk."""
