//! What several readers and writers share: telling formats apart, the meaning of names, the grammar of PLY and VTK.

pub(crate) mod catalog;
pub(crate) mod detect;
pub(crate) mod foreign;
pub(crate) mod names;
pub(crate) mod npy_header;
pub(crate) mod ply;
pub(crate) mod vtk;
pub(crate) mod vtkxml;
