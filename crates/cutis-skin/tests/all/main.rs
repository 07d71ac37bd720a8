//! Tests of the fields on skins, against closed forms and brute force.

mod depth;
mod directions;
mod drawn_path;
mod normals;
mod real_data;
mod shapes;
mod skin_moves;
mod strokes;
mod threads;
