"""The paper once more: its case study, its figures, its statements beside ours."""
