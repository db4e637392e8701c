"""Places, results, reasons and remarks as saved, also by earlier versions."""
