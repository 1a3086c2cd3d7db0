//! Tests of perception's public interface, in one program, so that shared code is built and linked
//! once.

mod boxes;
mod colours;
mod composed;
mod constants;
mod corridor;
mod damaged;
mod dining_room;
mod files;
mod household;
mod lab;
mod learning;
mod merging;
mod neighbours;
mod pieces;
mod provenance;
mod recognising;
mod registration;
mod robust;
mod rooms;
mod sensor;
mod shapes;
mod surfaces;
mod tabletop;
mod told;
mod unit;
