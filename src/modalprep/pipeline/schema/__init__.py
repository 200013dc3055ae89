"""What a pipeline file may say."""
