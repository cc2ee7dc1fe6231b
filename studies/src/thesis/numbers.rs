//! The thesis' numbers on sections that other pages have too.

use quadrant_report::{Block, Section};

/// The thesis' number of a block: the block's id, and "Table 3.1" or "Figure 3.5a".
pub(super) type Number = (&'static str, &'static str);

/// Puts sections under a chapter: blocks with a number get it as label and id, all other ids get the chapter in front, so that
/// nothing is called the same as in another chapter.
pub(super) fn number(sections: Vec<Section>, chapter: &str, numbers: &[Number]) -> Vec<Section> {
    sections
        .into_iter()
        .map(|section| Section {
            provenance: None,
            id: format!("{chapter}-{}", section.id),
            blocks: section
                .blocks
                .into_iter()
                .map(|block| number_block(block, chapter, numbers))
                .collect(),
            ..section
        })
        .collect()
}

fn number_block(mut block: Block, chapter: &str, numbers: &[Number]) -> Block {
    let id = match &mut block {
        Block::Table(table) => &mut table.id,
        Block::Figure(figure) => &mut figure.id,
        Block::Labelled { .. } => return block,
    };
    match numbers.iter().find(|(own, _)| own == id) {
        Some((_, label)) => {
            *id = label.to_lowercase().replace([' ', '.'], "-");
            block.labelled(*label)
        }
        None => {
            *id = format!("{chapter}-{id}");
            block
        }
    }
}
