"""Read and write pictures and videos."""
