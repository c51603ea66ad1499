//! Serialized meshes.
