//! What descry promises on the command line: one program, so that what all tests share is built and linked once.

mod beside;
mod binary;
mod body;
mod cluster;
mod command_line;
mod damage;
mod denied;
mod explain;
mod hand;
mod household;
mod kills;
mod live;
mod lsp;
mod own_domain;
mod page;
mod programs;
mod readme;
mod record;
mod shapes;
mod signals;
mod surfaces;
mod survey;
mod terminal;
mod tutorial;
mod unmapped;
mod writing;
