//! Overhead of a program as a body: 640 x 480 depths of 16 bits that a Python program holds ready, over pipes
//! and sockets, compared with the same bytes through a bare pipe.
//!
//! `cargo run --release -p descry-measure --bin throughput [-- FRAMES]`

use descry_robots::nalgebra::Point3;
use descry_robots::program::{Limits, ProgramRobot};
use descry_robots::{Robot, Watch};
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const BODY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/tests/programs/frames.py");
const FRAME_BYTES: usize = 2 * 640 * 480;
/// Number of short requests for each frame.
const QUESTIONS: usize = 10;

type Anyhow<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Anyhow<()> {
    let frames: usize = std::env::args().nth(1).map_or(Ok(500), |n| n.parse())?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let bare_s = bare_pipe(frames)?;
    println!("{:<22}{:>12}{:>10}{:>16}{:>14}", "", "frames/s", "MB/s", "of a bare pipe", "question, µs");
    println!("{:<22}{}", "bare pipe", rates(bare_s, bare_s));
    let cloud_s = clouds(frames)?;
    println!("{:<22}{}", "depths to a cloud", rates(cloud_s, bare_s));
    let piped = ProgramRobot::start(&format!("python3 '{BODY}'"), Limits::default())?;
    runtime.block_on(measure("pipes", &piped, frames, bare_s))?;
    let unix =
        std::env::temp_dir().join(format!("descry-throughput-{}", std::process::id())).display().to_string();
    for (name, address) in [("Unix socket", unix), ("TCP on loopback", "127.0.0.1:47319".into())] {
        let mut program = Command::new("python3").args([BODY, address.as_str()]).spawn()?;
        let measured =
            reach(&address).and_then(|robot| runtime.block_on(measure(name, &robot, frames, bare_s)));
        end(&mut program);
        measured?;
    }
    Ok(())
}

/// Formats seconds a frame as frames and bytes a second, and as a share of the bare pipe's rate.
fn rates(frame_s: f64, bare_s: f64) -> String {
    let megabytes = FRAME_BYTES as f64 / frame_s * 1e-6;
    format!("{:>12.0}{megabytes:>10.0}{:>16.2}", 1.0 / frame_s, bare_s / frame_s)
}

/// Time of the same bytes from Python without a protocol, seconds a frame.
fn bare_pipe(frames: usize) -> Anyhow<f64> {
    let script = format!(
        "import os\nd=bytes({FRAME_BYTES})\nfor _ in range({frames}):\n v=memoryview(d)\n while v: v=v[os.write(1,v):]"
    );
    let mut program = Command::new("python3").args(["-c", &script]).stdout(Stdio::piped()).spawn()?;
    let mut from = program.stdout.take().ok_or("no pipe")?;
    let mut frame = vec![0; FRAME_BYTES];
    from.read_exact(&mut frame)?;
    let started = Instant::now();
    for _ in 1..frames {
        from.read_exact(&mut frame)?;
    }
    let taken_s = started.elapsed().as_secs_f64() / (frames - 1).max(1) as f64;
    end(&mut program);
    Ok(taken_s)
}

/// Time of converting as many depths to a cloud, seconds a frame.
fn clouds(frames: usize) -> Anyhow<f64> {
    let camera = descry_robots::perception::Intrinsics {
        width: 640,
        height: 480,
        fx: 570.0,
        fy: 570.0,
        cx: 319.5,
        cy: 239.5,
    };
    let depth_m = vec![1.5_f32; 640 * 480];
    let started = Instant::now();
    for _ in 0..frames {
        std::hint::black_box(camera.cloud_from_depth(&depth_m).map_err(|e| e.to_string())?);
    }
    Ok(started.elapsed().as_secs_f64() / frames as f64)
}

/// Connects as soon as the program listens.
fn reach(address: &str) -> Anyhow<ProgramRobot> {
    let until = Instant::now() + Duration::from_secs(20);
    loop {
        match ProgramRobot::connect(address, Limits::default()) {
            Err(e) if Instant::now() > until => return Err(e.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(50)),
            Ok(robot) => return Ok(robot),
        }
    }
}

async fn measure(name: &str, robot: &ProgramRobot, frames: usize, bare_s: f64) -> Anyhow<()> {
    let watch = Watch::default();
    robot.sense(&watch).await?;
    let started = Instant::now();
    for _ in 0..frames {
        robot.sense(&watch).await?;
    }
    let frame_s = started.elapsed().as_secs_f64() / frames as f64;
    let questions = QUESTIONS * frames;
    let started = Instant::now();
    for _ in 0..questions {
        robot.pose().await?;
    }
    let question_us = started.elapsed().as_secs_f64() / questions as f64 * 1e6;
    println!("{name:<22}{}{question_us:>14.0}", rates(frame_s, bare_s));
    let started = Instant::now();
    for k in 0..frames {
        robot.look_at(&Point3::new(0.0, 0.1 * (k % 2) as f64, 0.7), &watch).await?;
        robot.sense(&watch).await?;
        robot.pose().await?;
    }
    let look_s = started.elapsed().as_secs_f64() / frames as f64;
    println!("{:<22}{:>12.2} ms a look beyond what the body needs (turn, frame, place)", "", look_s * 1e3);
    Ok(())
}

fn end(program: &mut Child) {
    // It may have ended by itself.
    let _ = program.kill();
    let _ = program.wait();
}
