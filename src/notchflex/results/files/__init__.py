"""Results as files and tables: JSON, CSV, NetCDF, Parquet, data frames."""
