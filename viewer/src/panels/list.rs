//! Maps each panel's name to its implementation, from the table in [`super`].

use crate::panels::pane::Pane;
use crate::panels::panel::Panel;

/// Generates that function from the table.
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
    /// Whether the panel can be shown as tables.
    pub(crate) fn has_table(self) -> bool {
        self.panel().table().is_some()
    }
}
