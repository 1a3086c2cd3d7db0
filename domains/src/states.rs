//! Values keyed by type: states of abilities, and values derived from a snapshot.

use std::any::Any;
use std::sync::{Arc, OnceLock};

/// State of an ability; every snapshot has a copy.
pub trait State: Any + Default + Clone + Send + Sync {
    /// Initial state, without any knowledge.
    fn nothing() -> &'static Self;
}

/// Makes a type the [`State`] of an ability.
macro_rules! state {
    ($of:ty) => {
        impl $crate::states::State for $of {
            fn nothing() -> &'static Self {
                static NOTHING: std::sync::LazyLock<$of> = std::sync::LazyLock::new(Default::default);
                &NOTHING
            }
        }
    };
}
pub(crate) use state;

/// States of abilities, one per type.
#[derive(Clone, Default)]
pub struct States(Option<Box<Kept>>);

#[derive(Clone)]
struct Kept {
    value: Arc<dyn Any + Send + Sync>,
    others: States,
}

impl States {
    /// State of a type; the initial one if never changed.
    pub fn get<T: State>(&self) -> &T {
        match &self.0 {
            Some(kept) => kept.value.downcast_ref().unwrap_or_else(|| kept.others.get()),
            None => T::nothing(),
        }
    }

    /// Mutable state of a type; earlier snapshots keep the old one.
    pub fn get_mut<T: State>(&mut self) -> &mut T {
        let fresh = || Box::new(Kept { value: Arc::new(T::default()), others: States::default() });
        let Kept { value, others } = &mut **self.0.get_or_insert_with(fresh);
        if Arc::get_mut(value).is_none()
            && let Some(shared) = value.downcast_ref::<T>().cloned()
        {
            *value = Arc::new(shared);
        }
        match Arc::get_mut(value).and_then(|value| value.downcast_mut()) {
            Some(found) => found,
            None => others.get_mut(),
        }
    }
}

/// Values derived from a snapshot, one per type, computed on first access.
#[derive(Default)]
pub struct Derived(OnceLock<Box<Made>>);

struct Made {
    value: Box<dyn Any + Send + Sync>,
    others: Derived,
}

impl Derived {
    /// Derived value of a type, computed by `make` on first access.
    pub fn get<T: Any + Send + Sync>(&self, make: &dyn Fn() -> T) -> &T {
        let made =
            self.0.get_or_init(|| Box::new(Made { value: Box::new(make()), others: Derived::default() }));
        made.value.downcast_ref().unwrap_or_else(|| made.others.get(make))
    }
}

impl std::fmt::Debug for Derived {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Derived")
    }
}
