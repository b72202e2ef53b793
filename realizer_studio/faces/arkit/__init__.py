"""The importer of heads with ARKit blend shapes."""
