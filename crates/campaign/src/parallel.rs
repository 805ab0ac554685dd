//! Items in all threads of the pool, their results in the items' order.
//!
//! The loop over threads is compiled once, here: `rayon`'s own collectors are compiled anew for each type of result and each closure, which was
//! a quarter of the code of the crates that ask questions.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Calls `task` with each number below `count`.
fn each(count: usize, task: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(task);
}

/// Maps items to their results, in the items' order. After an error no further item begins.
///
/// # Errors
/// That of the first item, in their order, of those that failed before the others stopped.
///
/// ```
/// let square = |number: u32| number.checked_mul(number).ok_or(number);
/// assert_eq!(standstill_campaign::in_parallel(vec![3, 1, 2], &square), Ok(vec![9, 1, 4]));
/// assert_eq!(standstill_campaign::in_parallel(vec![3, 70_000], &square), Err(70_000));
/// ```
pub fn in_parallel<I: Send, T: Send, E: Send>(
    items: Vec<I>,
    task: &(dyn Fn(I) -> Result<T, E> + Sync),
) -> Result<Vec<T>, E> {
    let items: Vec<_> = items.into_iter().map(|item| Mutex::new((Some(item), None))).collect();
    let failed = AtomicBool::new(false);
    each(items.len(), &|number| {
        let Ok(mut slot) = items[number].lock() else { return };
        if let Some(item) = slot.0.take().filter(|_| !failed.load(Ordering::Relaxed)) {
            let result = task(item);
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            slot.1 = Some(result);
        }
    });
    items.into_iter().filter_map(|slot| slot.into_inner().ok()?.1).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

    #[test]
    fn law_results_have_the_order_of_their_items() {
        let items: Vec<usize> = (0..1000).rev().collect();
        let doubled = in_parallel(items.clone(), &|item| Ok::<_, ()>(2 * item));
        assert_eq!(doubled, Ok(items.iter().map(|item| 2 * item).collect()));
        assert_eq!(in_parallel(Vec::new(), &Ok::<(), ()>), Ok(Vec::new()));
    }

    #[test]
    fn law_the_first_error_is_returned_and_ends_the_rest() {
        let begun = AtomicUsize::new(0);
        let fails = |item: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if item.is_multiple_of(7) { Err(item) } else { Ok(item) }
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let result = pool.install(|| in_parallel((5..100_000).collect(), &fails));
        assert_eq!((result, begun.load(Ordering::Relaxed)), (Err(7), 3));
        let items: Vec<usize> = (1..1000).collect();
        assert!(in_parallel(items, &fails).is_err_and(|item| item.is_multiple_of(7)));
    }
}
