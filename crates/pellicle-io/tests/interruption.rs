//! In a process of its own, since it removes all temporary files of the process.

use std::fs;

use pellicle_io::{PlyFile, PlyLayout, check_writable, remove_temporaries};

#[test]
fn interrupted_output_leaves_nothing_and_does_not_finish() {
    let folder = std::env::temp_dir().join(format!("pellicle-io-interruption-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for the test");
    let entries = || fs::read_dir(&folder).map(Iterator::count).ok();
    let path = folder.join("a.ply");
    let first = PlyFile::create(&path, &PlyLayout::default()).expect("the folder exists");
    let second = PlyFile::create(&path, &PlyLayout::default()).expect("names are unique");
    // Linux needs no names for unfinished files.
    assert!(entries() <= Some(2));
    drop(first);
    assert!(entries() <= Some(1));
    remove_temporaries();
    assert_eq!(entries(), Some(0));
    assert!(second.finish().is_err());
    assert!(!path.exists());
    check_writable(&path).expect("it could be written");
    assert_eq!(entries(), Some(0));
    fs::remove_dir(&folder).expect("the folder is empty");
}
