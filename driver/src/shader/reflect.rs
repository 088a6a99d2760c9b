//! What a shader wants of the pipeline's layout.
