"""Places, results, reasons and remarks, as saved by this version and earlier ones."""
