"""The figures of this section, a file each; see `rigid.report.gallery`."""
