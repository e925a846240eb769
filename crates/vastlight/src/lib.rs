//! The facade: open a scene, render it, trace arrays of rays.
