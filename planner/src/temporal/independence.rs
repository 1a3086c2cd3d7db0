//! Independence of happenings: an action's start and end, and snap actions of several actions.

use crate::ground::GroundOutcome;

use super::mentions::disturbs_itself;
use super::together::some_only_together;
use super::touch::{Touched, expression_touches};
use super::world::{Act, World};

impl World<'_> {
    /// True if the search's steps cover every plan: no durations chosen for effects, no reads of
    /// continuously changing numbers, and no required simultaneous starts or ends.
    pub fn is_complete(&self) -> bool {
        *self.complete.get_or_init(|| !self.chooses_numbers() && !some_only_together(self))
    }

    /// True if an action's end is independent of its start: neither changes what the other
    /// accesses.
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
