//! Text of the unknowns, from which a daemon sees that its configuration has changed: that of the version whose fits it has kept.

use core::fmt;

use super::{MAX_SOUGHT, Role, Sought};

impl fmt::Debug for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absent => f.write_str("Absent"),
            Self::Fixed(value) => f.debug_tuple("Fixed").field(value).finish(),
            Self::Sought(unknown) => f
                .debug_struct("Free")
                .field("unknown", unknown)
                .field("prior", &None::<f64>)
                .finish(),
        }
    }
}

/// The roles of the parameters, and those of as many others that are absent.
struct Roles<'a>(&'a [Role]);

impl fmt::Debug for Roles<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let others = core::iter::repeat_n(&Role::Absent, MAX_SOUGHT);
        f.debug_list().entries(self.0.iter().chain(others)).finish()
    }
}

impl fmt::Debug for Sought {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = f.debug_struct("Sought");
        text.field("joints", &self.joints)
            .field("unknowns", &self.parameters)
            .field("roles", &Roles(&self.roles))
            .field("expects_stiffnesses", &self.expects_stiffnesses);
        if !self.imperfections.is_empty() {
            text.field("imperfections", &self.imperfections);
        }
        text.finish()
    }
}
