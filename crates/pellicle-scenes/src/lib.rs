//! Deterministic particle scenes.
