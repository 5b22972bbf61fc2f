use super::*;

#[test]
fn what_is_beyond_the_slice_is_refused() {
    let samples = [0u8; 24];
    assert!(matches!(Volume::new(&samples, [2, 3, 5]), Err(Error::Length { found: 24, expected: 30, .. })));
    assert!(Volume::strided(&samples, [2, 3, 4], 0, [12, 4, 1]).is_ok());
    assert!(Volume::strided(&samples, [2, 3, 4], 23, [-12, -4, -1]).is_ok());
    assert!(matches!(
        Volume::strided(&samples, [2, 3, 4], 1, [12, 4, 1]),
        Err(Error::Strides { lowest: 1, highest: 24, len: 24 })
    ));
    assert!(matches!(Volume::strided(&samples, [2, 3, 4], 22, [-12, -4, -1]), Err(Error::Strides { lowest: -1, .. })));
    assert!(Volume::strided(&samples, [2, 2, 2], 0, [isize::MAX, isize::MIN, isize::MAX]).is_err());
}

#[test]
fn flat_and_endless_volumes_are_refused() {
    let samples = [0.0f32; 16];
    for dims in [[4, 4, 1], [0, 4, 4], [1, 1, 16], [usize::MAX, 2, 2], [1 << 30, 1 << 30, 1 << 30]] {
        assert!(matches!(Volume::new(&samples, dims), Err(Error::Dims { .. })), "{dims:?}");
    }
}

#[test]
fn directions_in_one_plane_are_refused() {
    let samples = [0i16; 8];
    let volume = Volume::new(&samples, [2, 2, 2]).expect("good");
    for bad in [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]],
        [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[f64::NAN, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[f64::INFINITY, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ] {
        assert!(volume.with_directions(bad).is_err(), "{bad:?}");
    }
    assert!(volume.with_spacing([1e-30, 1e-30, 2e-30]).is_ok());
    assert!(volume.with_spacing([1.0, -1.0, 1.0]).expect("mirrored").is_left_handed());
    assert!(volume.with_origin([0.0, f64::NAN, 0.0]).is_err());
    assert!(volume.with_mask(&[true; 7]).is_err());
}

/// Every type against the plain comparison in doubles.
fn agrees<T: Scalar + std::fmt::Debug>(values: &[T], isos: &[f64]) {
    for &iso in isos {
        for &v in values {
            let inside = match T::cut(iso) {
                Cut::All => true,
                Cut::Above(above) => v > above,
            };
            assert_eq!(inside, v.to_f64() > iso, "{v:?} > {iso}");
        }
    }
}

#[test]
fn cuts_agree_with_the_comparison_in_doubles() {
    let isos = [-1e300, -129.0, -128.5, -1.0, -0.5, -0.0, 0.0, 0.1, 0.5, 1.0, 126.9, 127.0, 254.5, 255.0, 300.0, 1e300];
    agrees(&[0u8, 1, 127, 254, 255], &isos);
    agrees(&[-128i8, -127, -1, 0, 1, 126, 127], &isos);
    agrees(&[0u32, 1, 255, u32::MAX], &isos);
    agrees(&[i32::MIN, -1, 0, 1, i32::MAX], &isos);
    agrees(&[i64::MIN, -1, 0, 1, 1 << 40], &isos);
    agrees(&[f32::NEG_INFINITY, f32::MIN, -1.0, 0.0, 0.1, 1.0, f32::MAX, f32::INFINITY, f32::NAN], &isos);
    agrees(&[f32::NAN, 0.1, 0.099_999_994], &[0.1, f64::from(0.1f32)]);
}
