//! Independence of the happenings of actions.

use crate::ground::GroundOutcome;

use super::mentions::disturbs_itself;
use super::together::some_only_together;
use super::touch::{Touched, expression_touches};
use super::world::{Act, World};

impl World<'_> {
    /// True if the steps of the search can produce every plan: no number depends on a chosen duration
    /// or on continuous change, and no actions have to start or end at the very same time.
    pub fn is_complete(&self) -> bool {
        *self.complete.get_or_init(|| !self.chooses_numbers() && !some_only_together(self))
    }

    /// True if the start and the end of an action are independent: neither changes what the other reads
    /// or changes.
    pub(super) fn ends_freely(&self, act: &Act) -> bool {
        let [mut read, mut written, mut end_read, mut end_written] = [(); 4].map(|()| Touched::default());
        read.condition(self, act.at_start);
        for bound in act.bounds {
            expression_touches(self, &bound.seconds, if bound.at_end { &mut end_read } else { &mut read });
        }
        act.start_effects.iter().for_each(|effect| written.outcome(self, &effect.outcome));
        [act.over_all, act.at_end].into_iter().for_each(|condition| end_read.condition(self, condition));
        for effect in act.end_effects {
            end_written.outcome(self, &effect.outcome);
            if let GroundOutcome::Change { amount, .. } = &effect.outcome {
                expression_touches(self, amount, &mut end_read);
            }
        }
        act.flow_effects.is_empty()
            && !written.meets(&end_read)
            && !written.meets(&end_written)
            && !read.meets(&end_written)
            && !disturbs_itself(self, act)
    }
}
