#!/bin/bash
exec /work/wt/shapes/target/debug/descry "$@"
