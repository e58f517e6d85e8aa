//! The panel that a name means, as the table in [`super`] has it.

use crate::panels::pane::Pane;
use crate::panels::panel::Panel;

/// Makes the function from names to panels from their table.
macro_rules! panels {
    ($($variant:ident: $name:literal, $title:literal, $home:expr, $help:literal, $($panel:ident)::+;)*) => {
        impl Pane {
            /// The panel itself.
            pub fn panel(self) -> &'static dyn Panel {
                match self {
                    $(Self::$variant => &crate::$($panel)::+,)*
                }
            }
        }
    };
}

panel_table!(panels);

impl Pane {
    /// Whether the panel can be looked at as tables.
    pub(crate) fn has_table(self) -> bool {
        self.panel().table().is_some()
    }
}
